//! Reads a study without its lock: it may be under way.

use super::super::plan::{Plan, Task};
use super::super::subject::Subject;
use super::super::subject_table::SubjectTable;
use super::super::trial::Trial;
use super::disk::at;
use super::error::StoreError;
use super::study_description::StudyDescription;
use super::{PLAN, STUDY, SUBJECTS, VERSION, subject_files};
use std::path::Path;
use std::{fs, io};

/// Reads what a study is, without a lock.
///
/// # Errors
/// There is no study, or its plan was changed.
pub fn read(folder: &Path) -> Result<(Plan, StudyDescription), StoreError> {
    let path = folder.join(STUDY);
    let text = match fs::read_to_string(&path) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Err(StoreError::NotAStudy(folder.to_owned()));
        }
        read => read.map_err(at(&path))?,
    };
    let about: StudyDescription = serde_json::from_str(&text).map_err(|error| at(&path)(error.into()))?;
    if about.version > VERSION {
        let found = about.version;
        return Err(StoreError::Version { path, found });
    }
    let path = folder.join(PLAN);
    let text = fs::read_to_string(&path).map_err(at(&path))?;
    let (expected, found) = (about.plan_crc32, crc32fast::hash(text.as_bytes()));
    if expected != found {
        return Err(StoreError::PlanChanged { path, expected, found });
    }
    let plan = Plan::read(&text).map_err(|source| StoreError::Plan { path, source })?;
    check_orders(&plan, &about)?;
    Ok((plan, about))
}

/// Checks that each subject's own order has everything once.
pub(super) fn check_orders(plan: &Plan, about: &StudyDescription) -> Result<(), StoreError> {
    let names = plan.ordered_names();
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort();
        names
    };
    let is_wrong = |order: &Vec<String>| !order.is_empty() && sorted(order) != sorted(&names);
    let mut wrong = about
        .orders
        .iter()
        .zip(&about.subjects)
        .filter(|(order, _)| is_wrong(order));
    wrong.next().map_or(Ok(()), |(order, subject)| {
        Err(StoreError::Order {
            subject: subject.clone(),
            found: order.join(" | "),
            names: names.join(" | "),
        })
    })
}

/// What is known of a study's subjects: their free fields are in `subjects.csv`. Nothing where it has no such file.
///
/// # Errors
/// The file cannot be read.
pub fn subjects(folder: &Path) -> Result<SubjectTable, StoreError> {
    let path = folder.join(SUBJECTS);
    match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(SubjectTable::default()),
        read => {
            let bytes = read.map_err(at(&path))?;
            SubjectTable::read(&bytes).map_err(|source| StoreError::Subjects { path, source })
        }
    }
}

/// All trials of a study, subject by subject, without those of practice. The study may be under way.
///
/// # Errors
/// There is no study, or a file of it cannot be read.
pub fn trials<T: Trial>(folder: &Path) -> Result<Vec<T>, StoreError> {
    let (_, about) = read(folder)?;
    let mut trials = Vec::new();
    for subject in about.all_subjects() {
        trials.extend(trials_of(folder, &subject, about.task)?);
    }
    Ok(trials)
}

/// All trials of one subject of a study, without those of practice. The study may be under way.
///
/// # Errors
/// The file cannot be read.
pub fn trials_of<T: Trial>(folder: &Path, subject: &Subject, task: Task) -> Result<Vec<T>, StoreError> {
    subject_files::trials(folder, subject, task, false)
}
