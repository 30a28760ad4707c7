//! Where in a file something is, and why a file is not a motion.

use crate::MAX_NUMBER;
use crate::table::TableError;
use std::fmt;
use std::path::Path;
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

/// Why a motion file cannot be used: its name, the place where that shows, and what is wrong.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct MotionError(String);

impl MotionError {
    /// What is wrong with a file.
    #[must_use]
    pub fn new(path: &Path, reason: impl fmt::Display) -> Self {
        Self(format!("{}: {reason}", path.display()))
    }

    pub(crate) fn at(path: &Path, place: Place, reason: impl fmt::Display) -> Self {
        Self(format!("{}, {place}: {reason}", path.display()))
    }

    /// A cell is not a number that can be worked with.
    pub(crate) fn not_a_number(path: &Path, place: Place, column: &str, value: impl fmt::Display) -> Self {
        let range = format_args!("from -{MAX_NUMBER:e} to {MAX_NUMBER:e}");
        Self::at(
            path,
            place,
            format_args!("{column} = `{value}` is not a number {range}"),
        )
    }

    /// A column holds something else than numbers.
    pub(crate) fn column_type(path: &Path, column: &str, found: &str) -> Self {
        Self::new(
            path,
            format_args!("the column `{column}` is of type {found}: numbers expected"),
        )
    }

    /// A column is missing among those of the header.
    pub(crate) fn missing_column(path: &Path, column: &str, header: &str) -> Self {
        let usual = "a motion has t_s, position_m or device_position_m and, where it was measured, velocity_mps or \
                     device_velocity_mps";
        Self::new(
            path,
            format_args!("the column `{column}` is missing; {usual}; this file has `{header}`"),
        )
    }
}

impl From<TableError> for MotionError {
    fn from(error: TableError) -> Self {
        Self(error.to_string())
    }
}
