//! Why a file is not a motion.

use crate::MAX_NUMBER;
use crate::table::TableError;
use std::path::{Path, PathBuf};
use std::{fmt, io};
use thiserror::Error;

/// Where in a file something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text, from 1.
    Line(u64),
    /// Distance from the beginning of an MCAP file, bytes.
    Byte(u64),
    /// A row of another format, from 1.
    Row(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// Why a motion file cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file is damaged, or uses a part of its format that is not supported.
    #[error("{}: {reason}", .path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the reader of the format says.
        reason: String,
    },
    /// It is a table of another program, which cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column is missing.
    #[error("{}: the column `{column}` is missing; a motion has t_s, position_m or device_position_m and, where it was measured, velocity_mps or device_velocity_mps; this file has `{header}`", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns found.
        header: String,
    },
    /// It is a motion in a plane.
    #[error("{}: a motion of two axes, with a column `{column}`, and this takes one axis", .path.display())]
    TwoAxes {
        /// The file.
        path: PathBuf,
        /// The position on the second axis.
        column: &'static str,
    },
    /// Two columns could be meant.
    #[error("{}: both `{first}` and `{second}` are columns, and either could be meant: remove or rename one", .path.display())]
    AmbiguousColumn {
        /// The file.
        path: PathBuf,
        /// One column.
        first: &'static str,
        /// The other column.
        second: &'static str,
    },
    /// A column occurs more than once.
    #[error("{}: there are {count} columns `{column}`, and any could be meant: remove or rename all but one", .path.display())]
    RepeatedColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// How often it occurs.
        count: usize,
    },
    /// A column holds something else than numbers.
    #[error("{}: the column `{column}` is of type {found}: numbers expected", .path.display())]
    ColumnType {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Its type.
        found: String,
    },
    /// A row ends before a column.
    #[error("{}, line {line}: the row has {cells} of {columns} cells, and none for {missing}", .path.display())]
    ShortRow {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
        /// The columns without a cell.
        missing: String,
    },
    /// A row continues after the last column.
    #[error("{}, line {line}: the row has {cells} cells, and the header {columns} columns", .path.display())]
    LongRow {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
    },
    /// A cell is not a number that can be worked with.
    #[error("{}, {place}: {column} = `{value}` is not a number from -{MAX_NUMBER:e} to {MAX_NUMBER:e}", .path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// The column.
        column: &'static str,
        /// The cell.
        value: String,
    },
    /// Time does not grow.
    #[error("{}, {place}: t_s = {t_s} s does not come after {before} s before it", .path.display())]
    TimeNotIncreasing {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// Time of that row, s.
        t_s: f64,
        /// Time of the row before, s.
        before: f64,
    },
    /// There is no row.
    #[error("{}: the file has no sample", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

impl MotionError {
    pub(crate) fn open(path: &Path, source: io::Error) -> Self {
        Self::Open {
            path: path.to_path_buf(),
            source,
        }
    }

    pub(crate) fn format(path: &Path, reason: impl fmt::Display) -> Self {
        Self::Format {
            path: path.to_path_buf(),
            reason: reason.to_string(),
        }
    }

    pub(crate) fn not_a_number(path: &Path, place: Place, column: &'static str, value: impl fmt::Display) -> Self {
        Self::NotANumber {
            path: path.to_path_buf(),
            place,
            column,
            value: value.to_string(),
        }
    }
}
