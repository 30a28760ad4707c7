//! Why a study cannot be stored, or continued.

use super::super::subject::{CodeError, StudyMismatch};
use super::{STUDY, VERSION};
use std::error::Error;
use std::io;
use std::path::PathBuf;

/// Why a study cannot be stored, or continued.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder has something in it.
    #[error("{}: {what}", .path.display())]
    Taken {
        /// The folder.
        path: PathBuf,
        /// What is there.
        what: String,
    },
    /// There is no study.
    #[error("{}: there is no study: it has no {STUDY}", .0.display())]
    NotAStudy(PathBuf),
    /// Another program runs it.
    #[error("{}: another program is running this study", .0.display())]
    Locked(PathBuf),
    /// A later version made it.
    #[error("{}: its version is {found}, and this program knows up to {VERSION}", .path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// The plan is not the one that the study began with.
    #[error(
        "{}: the plan was changed since the study began: its checksum was {expected:08x} and is {found:08x}; put the \
         old plan back, or make a new study", .path.display()
    )]
    PlanChanged {
        /// The file.
        path: PathBuf,
        /// Checksum at the beginning.
        expected: u32,
        /// Checksum now.
        found: u32,
    },
    /// What is in a file cannot be used: a plan, a table of subjects, trials.
    #[error("{}: {source}", .path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The subjects cannot take part under these codes.
    #[error(transparent)]
    Codes(#[from] CodeError),
    /// A subject's own order lacks something, or has it twice.
    #[error("subject {subject}: order = `{found}` is not a permutation of `{names}`")]
    Order {
        /// The subject's code.
        subject: String,
        /// The order.
        found: String,
        /// What it must have once each.
        names: String,
    },
    /// There is no such subject.
    #[error("`{code}` is not a subject of this study; there are {known}")]
    NoSubject {
        /// The code.
        code: String,
        /// Those that there are.
        known: String,
    },
    /// A file of rows has a column that no row of this program has.
    #[error("{}: the column `{column}` is none of this program's, and would be lost: keep it in another file, or finish the \
             study with the version that began it", .path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// The rows are not those of the plan.
    #[error(transparent)]
    StudyMismatch(#[from] StudyMismatch),
    /// A folder has no data.
    #[error("{}: no trials: a study has them in data/subject-CODE/, in files that end in _data.csv", .0.display())]
    NoData(PathBuf),
    /// A folder has trials of both tasks; this is the first file of the other one.
    #[error("{}: answers of a perception test beside trials of a targeting task: analyse each alone", .0.display())]
    BothTasks(PathBuf),
    /// A file cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}
