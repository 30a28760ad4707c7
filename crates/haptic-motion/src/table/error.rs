//! Why a table cannot be read, and where in its file.

use crate::error::Place;
use std::path::PathBuf;
use thiserror::Error;

/// Why a table cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file has no table.
    #[error("{}: {reason}", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
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
    /// A column of a Parquet file cannot be read.
    #[error("{}: the column `{column}` is not read: {reason}", .path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// Why.
        reason: String,
    },
    /// The file is neither text nor Parquet.
    #[error("{}: not a table: the file is neither text nor Parquet", .path.display())]
    NotText {
        /// The file.
        path: PathBuf,
    },
    /// Columns or units are given of a file whose own are known.
    #[error("{}: the columns of a recording in MCAP or Parquet cannot be named, nor those of another MCAP file, and their \
             units are known; `haptic-ctl recording export` makes CSV of a recording", .path.display())]
    NoTable {
        /// The file.
        path: PathBuf,
    },
    /// A gain cannot be.
    #[error("{option} = {value} is not a finite number other than 0")]
    Gain {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
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
    /// A cell is not a number.
    #[error("{}, {place}: {column} = `{value}` is not a number", .path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// The column.
        column: String,
        /// The cell.
        value: String,
    },
    /// A row ends before a column.
    #[error("{}, line {line}: the row has {cells} cells, and none for {column}", .path.display())]
    ShortRow {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: usize,
        /// Cells in the row.
        cells: usize,
        /// The column.
        column: String,
    },
    /// Time goes back, and does so again and again.
    #[error("{}, {place}: time goes back from {before_s} s to {t_s} s, as it does {falls} times: no clock does that; \
             name the time column with --time-column, or give the takes one by one", .path.display())]
    TimeGoesBack {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// Time there, s.
        t_s: f64,
        /// Time in the row before, s.
        before_s: f64,
        /// How often it goes back, or is wrong.
        falls: usize,
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
}

impl TableError {
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
