//! Why a record cannot be read.

use haptic_motion::table::TableError;
use std::path::PathBuf;
use thiserror::Error;

/// Why a record cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordFileError {
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A recording of hapticd is damaged.
    #[error("{}: {source}{}", .path.display(), .source.remedy())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: haptic_recording::RecordingError,
    },
    /// A recording holds nothing of what was asked for.
    #[error("{}: {reason}", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// Another program wrote it, in a format that is read of hapticd alone.
    #[error("{}: hapticd did not write this MCAP file; tables of other programs are read from CSV and \
             Parquet", .path.display())]
    OtherMcap {
        /// The file.
        path: PathBuf,
    },
    /// An option has no meaning for this kind of file.
    #[error("{option} has no meaning for {}: {reason}", .path.display())]
    NoMeaning {
        /// The option.
        option: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        reason: &'static str,
    },
    /// The two files have no time in common.
    #[error("{} and {} have less than 1 s in common", .path.display(), .force_path.display())]
    Apart {
        /// The file of positions.
        path: PathBuf,
        /// The file of forces.
        force_path: PathBuf,
    },
}
