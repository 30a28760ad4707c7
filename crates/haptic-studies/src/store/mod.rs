//! A study on the disk, in the layout of Psych-DS.
//!
//! ```text
//! DIR/dataset_description.json          what Psych-DS asks for
//!     plan.toml                         the plan, as it was given
//!     study.json                        seed, subjects, operator
//!     subjects.csv                      the subjects' codes, and free fields
//!     .lock                             held by the program that runs the study
//!     data/subject-01/session-01/
//!         subject-01_session-01_task-fitts_data.csv        a row a trial
//!         subject-01_session-01_task-fitts_data.json       what is known of the subject's screen
//!         subject-01_session-01_task-fitts_practice.csv    the same rows of practice
//!         recordings/trial-0001.mcap    every tick of the trial
//!         subject-01_session-01_task-fitts_voided.csv      attempts that do not count
//!     notes.csv                         the experimenter's notes
//!     trials.parquet                    all rows
//! ```
//!
//! A trial is done once its row is on the disk, and the next one begins after that; its recording is there before its
//! row. A row that was cut off in the middle is taken away when the study is opened again, and a recording without a
//! row is kept as `....unscored-1.mcap`. Nothing is overwritten.

mod disk;
mod error;
mod keeper;
mod notes;
mod parquet;
mod reader;
mod sidecar;
mod study_description;
mod subject_files;

use super::plan::{Plan, Task};
use super::subject::{Subject, check_codes};
use super::subject_table::SubjectTable;
use super::trial::{FittsTrial, Operator, PerceptionTrial, Trial};
use disk::{at, replace, sync_folder, write_new, wrong};
pub use error::StoreError;
use haptic_ipc::quoted;
pub use keeper::{Keeper, RigDescription};
pub use notes::note;
pub use reader::{Trials, read, read_file, read_folder, subjects, trials, unfinished};
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};
pub use study_description::StudyDescription;
pub use subject_files::trials_of;

/// A study on the disk, which this program alone may continue.
#[derive(Debug)]
pub struct Study {
    folder: PathBuf,
    plan: Plan,
    about: StudyDescription,
    _lock: Lock,
}

impl Study {
    /// Creates a study in a folder that is not there, or empty, with what is known of its subjects. It is there as a
    /// whole or not at all.
    ///
    /// # Errors
    /// The folder has something in it, or cannot be written.
    pub fn create(
        folder: &Path,
        plan_text: &str,
        about: &StudyDescription,
        subjects: &SubjectTable,
    ) -> Result<Self, StoreError> {
        if folder.join(STUDY).exists() {
            return Err(StoreError::of(folder, &difference(folder, about)));
        }
        let plan = Plan::read(plan_text).map_err(wrong(&folder.join(PLAN)))?;
        check_codes(&about.subjects)?;
        reader::check_orders(&plan, about)?;
        let parent = match folder.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let made = tempfile::Builder::new().prefix(".study-").tempdir_in(parent);
        let made = made.map_err(at(parent))?;
        // A temporary folder is closed to everybody else; a study is as open as other folders.
        let inside = made.path().join("study");
        fs::create_dir(&inside).map_err(at(&inside))?;
        write_new(&inside.join(PLAN), plan_text.as_bytes())?;
        write_new(&inside.join(DESCRIPTION), &description(&plan, about)?)?;
        write_new(&inside.join(SUBJECTS), &subjects.csv().map_err(at(folder))?)?;
        // Held before anybody else can find the study.
        let lock = hold(&inside)?;
        let text = serde_json::to_vec_pretty(about).map_err(at(folder))?;
        write_new(&inside.join(STUDY), &text)?;
        sync_folder(&inside)?;
        fs::rename(&inside, folder).map_err(|error| match error.kind() {
            io::ErrorKind::DirectoryNotEmpty | io::ErrorKind::NotADirectory => {
                let why = "it is there already, and not an empty folder; nothing is overwritten";
                StoreError::of(folder, why)
            }
            _ => at(folder)(error),
        })?;
        sync_folder(parent)?;
        Ok(Self::held(folder, read(folder)?, lock))
    }

    /// Opens a study to continue it.
    ///
    /// # Errors
    /// There is none, another program runs it, or its plan was changed.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        let of_folder = read(folder)?;
        Ok(Self::held(folder, of_folder, hold(folder)?))
    }

    /// Adds subjects after those that it has, whose codes, orders and rows stay: no order depends on who comes later.
    ///
    /// # Errors
    /// One has a code that is there, or an order that is not of the plan, or a file cannot be written.
    pub fn add(&mut self, subjects: &SubjectTable) -> Result<(), StoreError> {
        let about = self.about.clone().with(subjects);
        check_codes(&about.subjects)?;
        reader::check_orders(&self.plan, &about)?;
        let mut table = reader::subjects(&self.folder)?;
        table.add(subjects);
        // Whoever is in the description is a subject, so that it comes last.
        let path = self.folder.join(STUDY);
        let table = table.csv().map_err(at(&self.folder))?;
        replace(&self.folder.join(SUBJECTS), &path, |file| file.write_all(&table))?;
        let text = serde_json::to_vec_pretty(&about).map_err(at(&path))?;
        replace(&path, &path, |file| file.write_all(&text))?;
        self.about = about;
        Ok(())
    }

    fn held(folder: &Path, (plan, about): (Plan, StudyDescription), lock: Lock) -> Self {
        Self {
            folder: folder.to_owned(),
            plan,
            about,
            _lock: lock,
        }
    }

    /// The plan.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What it is beside the plan.
    #[must_use]
    pub fn about(&self) -> &StudyDescription {
        &self.about
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its subjects.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        self.about.all_subjects()
    }

    /// The subject of a code.
    ///
    /// # Errors
    /// There is none.
    pub fn subject_of(&self, code: &str) -> Result<Subject, StoreError> {
        let found = self.subjects().find(|subject| subject.code == code);
        found.ok_or_else(|| {
            let known = self.about.subjects.join(", ");
            StoreError::Refused(format!("`{code}` is not a subject of this study; there are {known}"))
        })
    }

    /// Trials that a subject has done, and trials in all or the most that there can be, practice included.
    ///
    /// # Errors
    /// Its files cannot be read, or are not those of the plan.
    pub fn progress(&self, subject: &Subject) -> Result<(usize, Option<usize>), StoreError> {
        let task = reader::task(&self.folder, &self.plan, &self.about, subject, reader::NO_TICK_S)?;
        Ok(task.progress())
    }

    /// Writes all trials that are done into one file, in place of an earlier one, and what is known of the subjects'
    /// screen beside the rows of each; returns that file, or nothing where no trial is done.
    ///
    /// # Errors
    /// They cannot be read, or it cannot be written.
    pub fn collect(&self) -> Result<Option<PathBuf>, StoreError> {
        match self.about.task {
            Task::Fitts => {
                self.describe_screens()?;
                self.collect_rows::<FittsTrial>()
            }
            Task::Perception => self.collect_rows::<PerceptionTrial>(),
        }
    }

    fn collect_rows<T: Trial>(&self) -> Result<Option<PathBuf>, StoreError> {
        let path = self.folder.join(ALL_TRIALS);
        let trials = trials::<T>(&self.folder)?;
        if trials.is_empty() {
            // Nothing of a subject who has withdrawn is kept.
            return match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(at(&path)(error)),
                _ => Ok(None),
            };
        }
        replace(&path, &self.folder.join(STUDY), |file| parquet::write(&trials, file))?;
        Ok(Some(path))
    }

    fn describe_screens(&self) -> Result<(), StoreError> {
        for subject in self.subjects() {
            let trials = trials_of(&self.folder, &subject, Task::Fitts, false)?;
            let path = subject_files::sidecar(&self.folder, &subject, Task::Fitts);
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let Some(described) = sidecar::of_trials(&name, &trials) else {
                continue;
            };
            let text = serde_json::to_vec_pretty(&described).map_err(at(&path))?;
            replace(&path, &self.folder.join(STUDY), |file| file.write_all(&text))?;
        }
        Ok(())
    }
}

/// A locked file. A program that is being started has the files of the one that starts it until it runs, and a lock
/// that ended with the file alone would last so long, too.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // Else it ends with the file.
        drop(self.0.unlock());
    }
}

/// Locks a study's folder, unless another program has.
fn hold(folder: &Path) -> Result<Lock, StoreError> {
    let path = folder.join(LOCK);
    let opened = File::options().append(true).create(true).open(&path);
    let lock = opened.map_err(at(&path))?;
    match lock.try_lock() {
        Ok(()) => Ok(Lock(lock)),
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked(folder.to_owned())),
        Err(TryLockError::Error(error)) => Err(at(&path)(error)),
    }
}

/// How the study that is there differs from the one to create.
fn difference(folder: &Path, about: &StudyDescription) -> String {
    let Ok((_, found)) = read(folder) else {
        return "there is a study already".to_owned();
    };
    let mut differing = Vec::new();
    for (name, differs) in [
        ("plan", found.plan_crc32 != about.plan_crc32),
        ("seed", found.seed != about.seed),
        ("subjects", found.subjects != about.subjects),
        ("operator", found.operator != about.operator),
    ] {
        if differs {
            differing.push(name);
        }
    }
    if differing.is_empty() {
        format!(
            "there is this study already; continue with `haptic-ctl study resume {}`, in the panel with Open study",
            quoted(folder)
        )
    } else {
        let differing = differing.join(" and ");
        let how = how_to_add(folder, &found, about).filter(|_| differing == "subjects");
        let how = how.unwrap_or_default();
        format!("there is another study already, which differs in {differing}; nothing is overwritten{how}")
    }
}

/// How the study that is there gets the subjects that it lacks of the one to create; nothing where it lacks none.
fn how_to_add(folder: &Path, found: &StudyDescription, about: &StudyDescription) -> Option<String> {
    let new = about.subjects.iter().filter(|code| !found.subjects.contains(code));
    let new: Vec<&str> = new.map(String::as_str).collect();
    let has_orders = !found.orders.is_empty() || !about.orders.is_empty();
    let option = match has_orders {
        true => "--subjects-file FILE".to_owned(),
        false => format!("--codes {}", new.join(",")),
    };
    let (who, folder) = (new.join(", "), quoted(folder));
    (!new.is_empty()).then(|| format!("; `haptic-ctl study add {folder} {option}` adds {who}"))
}

/// What Psych-DS asks for.
fn description(plan: &Plan, about: &StudyDescription) -> Result<Vec<u8>, StoreError> {
    let who = match about.operator {
        Operator::Human => "people",
        Operator::Simulated => "a simulated operator, and no people",
    };
    let columns = match about.task {
        Task::Fitts => FittsTrial::names().collect::<Vec<_>>(),
        Task::Perception => PerceptionTrial::names().collect(),
    };
    let description = serde_json::json!({
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": plan.name(),
        "description": format!(
            "{}, done by {who}, on a one-axis force-feedback rig of {}. Lengths in m, times in s, forces in N.",
            plan.name(), about.program
        ),
        "schemaVersion": "Psych-DS 0.4.0",
        "variableMeasured": columns,
    });
    serde_json::to_vec_pretty(&description).map_err(at(Path::new(DESCRIPTION)))
}

const PLAN: &str = "plan.toml";
const STUDY: &str = "study.json";
const DESCRIPTION: &str = "dataset_description.json";
const SUBJECTS: &str = "subjects.csv";
const LOCK: &str = ".lock";
const DATA: &str = "data";
const ALL_TRIALS: &str = "trials.parquet";

/// The newest version of the layout: the second has orders of the subjects' own.
const VERSION: u32 = 2;

#[cfg(test)]
mod tests;
