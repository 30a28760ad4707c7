//! Which formats a recording may have.

use crate::error::RecordingError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Format of a recording's file. All three hold the same, and are read back to the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// MCAP, which robotics tools open: `.mcap`. The default.
    Mcap,
    /// CSV with metadata in lines of `#`: `.csv`.
    Csv,
    /// Parquet, for data frames and databases: `.parquet`. The smallest.
    Parquet,
}

/// A file name says no format.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}: the name of a recording ends in .mcap, .csv or .parquet", .path.display())]
pub struct UnknownFormat {
    /// The file.
    pub path: PathBuf,
}

impl Format {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Mcap, Self::Csv, Self::Parquet];

    /// The format that the ending of a file's name says, in upper or lower case.
    ///
    /// # Errors
    /// The ending is none of the three.
    pub fn of(path: &Path) -> Result<Self, UnknownFormat> {
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        Self::ALL
            .into_iter()
            .find(|format| ending.eq_ignore_ascii_case(format.ending()))
            .ok_or_else(|| UnknownFormat {
                path: path.to_path_buf(),
            })
    }

    /// Ending of a file's name, without its dot.
    #[must_use]
    pub const fn ending(self) -> &'static str {
        match self {
            Self::Mcap => "mcap",
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mcap => "MCAP",
            Self::Csv => "CSV",
            Self::Parquet => "Parquet",
        })
    }
}

/// Version of a recording of one axis.
pub(crate) const VERSION: u32 = 1;

/// Version of a recording of two axes: the same with the columns of the second axis behind the others.
const VERSION_OF_PLANE: u32 = 2;

/// The version of a recording by its axes.
pub(crate) const fn version(axes: u8) -> u32 {
    match axes {
        2 => VERSION_OF_PLANE,
        _ => VERSION,
    }
}

/// The axes of a recording by its version.
///
/// # Errors
/// This program does not know the version.
pub(crate) fn axes(version: &str) -> Result<u8, RecordingError> {
    [1, 2]
        .into_iter()
        .find(|axes| version == self::version(*axes).to_string())
        .ok_or_else(|| {
            let reads = "this program reads versions 1 and 2";
            RecordingError::Unknown(format!("a recording of version {version}; {reads}"))
        })
}
