//! Where the files of a subject are, and what is in those of rows.

use super::super::plan::Task;
use super::super::subject::Subject;
use super::super::trial::{self, Trial};
use super::DATA;
use super::disk::{at, whole_lines, wrong};
use super::error::StoreError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Folder of a subject's session.
pub(super) fn session(folder: &Path, subject: &Subject) -> PathBuf {
    folder
        .join(DATA)
        .join(format!("subject-{}", subject.code))
        .join(format!("session-{:02}", subject.session))
}

/// The file of a subject's rows of a kind.
pub(super) fn table(folder: &Path, subject: &Subject, task: Task, ending: &str) -> PathBuf {
    let Subject {
        code, session: number, ..
    } = subject;
    session(folder, subject).join(format!(
        "subject-{code}_session-{number:02}_task-{}_{ending}.csv",
        task.name()
    ))
}

/// The file of a subject's rows, of practice or of the trials that count.
pub(super) fn rows_file(folder: &Path, subject: &Subject, task: Task, is_practice: bool) -> PathBuf {
    table(folder, subject, task, if is_practice { "practice" } else { "data" })
}

/// The file of what is known about a subject's trials.
pub(super) fn sidecar(folder: &Path, subject: &Subject, task: Task) -> PathBuf {
    rows_file(folder, subject, task, false).with_extension("json")
}

/// The whole rows of a subject of a study, of practice or of the trials that count. The study may be under way.
///
/// # Errors
/// The file cannot be read.
pub fn trials_of<T: Trial>(
    folder: &Path,
    subject: &Subject,
    task: Task,
    is_practice: bool,
) -> Result<Vec<T>, StoreError> {
    rows(&rows_file(folder, subject, task, is_practice)).map(|rows| rows.trials)
}

/// What a file of rows holds.
pub(super) struct Rows<T> {
    pub(super) trials: Vec<T>,
    /// Length of the whole rows, bytes.
    pub(super) whole: usize,
    /// Length of the file, bytes.
    pub(super) all: usize,
    /// Its columns.
    pub(super) heading: Vec<String>,
}

/// Reads the whole rows of a file, of which the last may be under way; none where there is no file.
pub(super) fn rows<T: Trial>(path: &Path) -> Result<Rows<T>, StoreError> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read.map_err(at(path))?,
    };
    let whole = whole_lines(&bytes);
    let trials = if whole == 0 {
        Vec::new()
    } else {
        trial::read(&bytes[..whole]).map_err(wrong(path))?
    };
    let all = bytes.len();
    let heading = trial::heading(&bytes[..whole]);
    Ok(Rows {
        trials,
        whole,
        all,
        heading,
    })
}
