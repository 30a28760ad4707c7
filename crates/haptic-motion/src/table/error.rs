//! Why a table cannot be read, and where in its file.

use crate::error::Place;
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a table cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableError {
    /// Columns are missing.
    #[error("{}: no {what} column among `{header}`: name it with {option} (usual names: {usual})", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// What they hold.
        what: String,
        /// The options that name them.
        option: String,
        /// The heading found.
        header: String,
        /// Names that are found by themselves.
        usual: String,
    },
    /// The unit in a column's title is not one of its quantity.
    #[error("{}: the unit of `{column}` is not known: {instead}", .path.display())]
    UnknownUnit {
        /// The file.
        path: PathBuf,
        /// The column with its unit.
        column: String,
        /// What to give.
        instead: &'static str,
    },
    /// Several columns may be the one.
    #[error("{}: which is the {what} of {candidates}? Name it with {option}, by its place where names are alike", .path.display())]
    AmbiguousColumn {
        /// The file.
        path: PathBuf,
        /// What it holds.
        what: &'static str,
        /// The option that names it.
        option: &'static str,
        /// Their titles, each with its place.
        candidates: String,
    },
    /// The unit of the times is not stated, and they are no seconds.
    #[error("{}: the times have no unit, and begin with {first}: rows {step} s apart are no motion. Is it in ms, us or \
             ns? Say so with --time-unit, or in the title, as in time_ms", .path.display())]
    NoTimeUnit {
        /// The file.
        path: PathBuf,
        /// The first time, in its unit.
        first: f64,
        /// The usual step, in the same.
        step: f64,
    },
    /// Something else, which neither a name of a column nor a unit mends; the text has the file and the place.
    #[error("{0}")]
    Other(String),
}

impl TableError {
    pub(crate) fn of(path: &Path, reason: impl fmt::Display) -> Self {
        Self::Other(format!("{}: {reason}", path.display()))
    }

    pub(super) fn at(path: &Path, place: Place, reason: impl fmt::Display) -> Self {
        Self::Other(format!("{}, {place}: {reason}", path.display()))
    }

    /// The error where no option names a column or a unit: the heading has to.
    #[must_use]
    pub fn by_heading(&self) -> String {
        match self {
            Self::MissingColumn {
                path,
                what,
                header,
                usual,
                ..
            } => format!(
                "{}: no {what} column among `{header}`: give it one of the usual names in the heading ({usual})",
                path.display()
            ),
            Self::UnknownUnit { path, column, .. } => format!(
                "{}: the unit of `{column}` is not known: write the column in s, m or N, and say so in its heading",
                path.display()
            ),
            Self::AmbiguousColumn {
                path, what, candidates, ..
            } => format!(
                "{}: which is the {what} of {candidates}? Rename the others in the heading",
                path.display()
            ),
            Self::NoTimeUnit { path, first, step } => format!(
                "{}: the times have no unit, and begin with {first}: rows {step} s apart are no motion. Say in the \
                 heading whether it is ms, us or ns, as in time_ms",
                path.display()
            ),
            error => error.to_string(),
        }
    }
}
