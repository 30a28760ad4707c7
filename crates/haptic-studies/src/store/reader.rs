//! Reads a study without its lock, since it may be under way, and trials from elsewhere.

use super::super::plan::Plan;
use super::super::session;
use super::super::subject::Subject;
use super::super::subject_table::SubjectTable;
use super::super::trial::{self, FittsTrial, PerceptionTrial, Trial};
use super::disk::{at, whole_lines, wrong};
use super::error::StoreError;
use super::study_description::StudyDescription;
use super::subject_files::trials_of;
use super::{DATA, PLAN, STUDY, SUBJECTS, VERSION};
use haptic_motion::guard::guarded;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::path::{Path, PathBuf};
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
    let about: StudyDescription = serde_json::from_str(&text).map_err(at(&path))?;
    if about.version > VERSION {
        let why = format!(
            "its version is {}, and this program knows up to {VERSION}",
            about.version
        );
        return Err(StoreError::of(&path, &why));
    }
    let path = folder.join(PLAN);
    let text = fs::read_to_string(&path).map_err(at(&path))?;
    let (expected, found) = (about.plan_crc32, crc32fast::hash(text.as_bytes()));
    if expected != found {
        let why = format!(
            "the plan was changed since the study began: its checksum was {expected:08x} and is {found:08x}; put the old \
             plan back, or make a new study"
        );
        return Err(StoreError::of(&path, &why));
    }
    let plan = Plan::of_study(&text).map_err(wrong(&path))?;
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
        let [order, names] = [order, &names].map(|names| names.join(" | "));
        Err(StoreError::Refused(format!(
            "subject {subject}: order = `{order}` is not a permutation of `{names}`"
        )))
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
        read => SubjectTable::read(&read.map_err(at(&path))?).map_err(wrong(&path)),
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
        trials.extend(trials_of(folder, &subject, about.task, false)?);
    }
    Ok(trials)
}

/// A subject's task, as far as the subject is. A tick takes `period_s`, s.
///
/// # Errors
/// The subject's files cannot be read, or are not those of the plan.
pub(super) fn task(
    folder: &Path,
    plan: &Plan,
    about: &StudyDescription,
    subject: &Subject,
    period_s: f64,
) -> Result<session::Task, StoreError> {
    let mut task = session::Task::new(plan, about.seed, subject, about.operator, period_s);
    match &mut task {
        session::Task::Fitts(task) => task.resume(
            &trials_of(folder, subject, about.task, true)?,
            &trials_of(folder, subject, about.task, false)?,
        )?,
        session::Task::Perception(task) => task.resume(
            &trials_of(folder, subject, about.task, true)?,
            &trials_of(folder, subject, about.task, false)?,
        )?,
    }
    Ok(task)
}

/// Trials that all subjects of an unfinished study have done, and trials in all or the most that there can be, where a
/// staircase has such a limit; practice is not counted. Nothing where the study is finished, or its files are not those
/// of the plan.
#[must_use]
pub fn unfinished(folder: &Path, plan: &Plan, about: &StudyDescription) -> Option<(usize, Option<usize>)> {
    let tasks = about
        .all_subjects()
        .map(|subject| task(folder, plan, about, &subject, NO_TICK_S));
    let tasks: Vec<session::Task> = tasks.collect::<Result<_, _>>().ok()?;
    let done = tasks.iter().map(|task| task.rows(false) as usize).sum();
    let is_finished = tasks.iter().all(session::Task::is_finished);
    (!is_finished).then(|| (done, plan.trials().map(|trials| trials * tasks.len())))
}

/// The time of a tick where none comes, so that it does not matter.
pub(super) const NO_TICK_S: f64 = 1.0;

/// The trials of one task.
#[derive(Clone, Debug, PartialEq)]
pub enum Trials {
    /// Of the targeting task.
    Fitts(Vec<FittsTrial>),
    /// Of a perception test.
    Perception(Vec<PerceptionTrial>),
}

/// A column that the answers of a perception test alone have.
const PERCEPTION_COLUMN: &str = "level_N";

/// The first bytes of a table of Parquet.
const PARQUET: &[u8] = b"PAR1";

/// Reads a file of trials, of text or Parquet, from this or another program. Its columns show the task.
///
/// # Errors
/// It cannot be read, or a row is wrong.
pub fn read_file(path: &Path) -> Result<Trials, StoreError> {
    let bytes = fs::read(path).map_err(at(path))?;
    if !bytes.starts_with(PARQUET) {
        return trials_in(path, &bytes);
    }
    let text = guarded(|| of_parquet(path)).map_err(|reason| at(path)(io::Error::other(reason)))?;
    trials_in(path, &text)
}

/// Reads all trials in a folder of data, without those of practice. It need not be a whole study, and a study may be
/// under way: the last line of a file counts only if it has an end.
///
/// # Errors
/// A file cannot be read or has a wrong row, or there are no trials, or those of both tasks.
pub fn read_folder(folder: &Path) -> Result<Trials, StoreError> {
    let mut paths = Vec::new();
    let data = folder.join(DATA);
    // A study has none before its first trial.
    if data.exists() || !folder.is_dir() {
        find(&data, &mut paths)?;
    }
    paths.sort();
    let mut all: Option<Trials> = None;
    for path in paths {
        let text = fs::read(&path).map_err(at(&path))?;
        let whole = whole_lines(&text);
        if whole == 0 {
            continue;
        }
        match (&mut all, trials_in(&path, &text[..whole])?) {
            (none @ None, read) => *none = Some(read),
            (Some(Trials::Fitts(trials)), Trials::Fitts(more)) => trials.extend(more),
            (Some(Trials::Perception(trials)), Trials::Perception(more)) => trials.extend(more),
            _ => {
                let why = "answers of a perception test beside trials of a targeting task: analyse each alone";
                return Err(StoreError::of(&path, why));
            }
        }
    }
    let none = "no trials: a study has them in data/subject-CODE/, in files that end in _data.csv";
    all.ok_or_else(|| StoreError::of(folder, none))
}

/// The files of trials in a folder and those below it.
fn find(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), StoreError> {
    for entry in fs::read_dir(folder).map_err(at(folder))? {
        let path = entry.map_err(at(folder))?.path();
        if path.is_dir() {
            find(&path, paths)?;
        } else if path.to_string_lossy().ends_with("_data.csv") {
            paths.push(path);
        }
    }
    Ok(())
}

fn trials_in(path: &Path, text: &[u8]) -> Result<Trials, StoreError> {
    let read = if trial::heading(text).iter().any(|name| name == PERCEPTION_COLUMN) {
        trial::read(text).map(Trials::Perception)
    } else {
        trial::read(text).map(Trials::Fitts)
    };
    read.map_err(wrong(path))
}

/// A table of Parquet as CSV.
fn of_parquet(path: &Path) -> parquet::errors::Result<Vec<u8>> {
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| ParquetError::External(Box::new(error));
    writer
        .write_record(schema.columns().iter().map(|column| column.name()))
        .map_err(failed)?;
    for row in reader.get_row_iter(None)? {
        let row = row?;
        let cells = row.get_column_iter().map(|(_, cell)| match cell {
            Field::Null => String::new(),
            Field::Str(text) => text.clone(),
            other => other.to_string(),
        });
        writer.write_record(cells).map_err(failed)?;
    }
    writer
        .into_inner()
        .map_err(|error| ParquetError::External(Box::new(error.into_error())))
}
