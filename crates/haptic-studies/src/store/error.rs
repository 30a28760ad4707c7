//! Why a study cannot be stored, or continued.

use super::super::subject::{CodeError, StudyMismatch};
use super::STUDY;
use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

/// Why a study cannot be stored, or continued.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// There is no study.
    #[error("{}: there is no study: it has no {STUDY}", .0.display())]
    NotAStudy(PathBuf),
    /// Another program runs it.
    #[error("{}: another program is running this study", .0.display())]
    Locked(PathBuf),
    /// A file or a subject is not as it must be: which, and why.
    #[error("{0}")]
    Refused(String),
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
    /// The rows are not those of the plan.
    #[error(transparent)]
    StudyMismatch(#[from] StudyMismatch),
    /// A file cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl StoreError {
    /// What is wrong with a file or a folder.
    pub(super) fn of(path: &Path, why: &str) -> Self {
        Self::Refused(format!("{}: {why}", path.display()))
    }
}
