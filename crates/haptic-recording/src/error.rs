//! Why a recording cannot be read or made, and how one ends.

use crate::format::UnknownFormat;
pub use haptic_motion::Place;
use std::path::PathBuf;
use std::{fmt, io};
use thiserror::Error;

/// Where a table without the inputs of the servo is of use.
pub(crate) const OTHER_TABLES: &str =
    "tables of other programs are read by `haptic-ctl identify`, `compare` and `simulate --motion`";

/// Why a recording cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It cannot be read further.
    #[error("{place}: {source}")]
    Read {
        /// Where.
        place: Place,
        /// The system's error.
        source: io::Error,
    },
    /// It is something else, or was written by a later release.
    #[error("{0}")]
    Unknown(String),
    /// It is of a format that recordings have, and of another program.
    #[error("not a recording: hapticd did not write this {format} file, which lacks {lacking}; {OTHER_TABLES}")]
    OtherProgram {
        /// Its format.
        format: &'static str,
        /// What every recording has.
        lacking: String,
    },
    /// It has two axes, and its reader takes one.
    #[error(
        "a recording of two axes, and this takes one axis; `haptic-ctl recording` shows, exports and cuts it, and \
         `replay` computes it again"
    )]
    TwoAxes,
    /// A part of it is missing or damaged; the text says where.
    #[error("{0}")]
    Damaged(String),
}

impl RecordingError {
    /// What is damaged at a place.
    pub(crate) fn at(place: Place, reason: impl fmt::Display) -> Self {
        Self::Damaged(format!("{place}: {reason}"))
    }

    pub(crate) fn no_rows(place: Place) -> Self {
        Self::at(place, "the recording was broken off before its first row")
    }

    pub(crate) fn metadata(place: Place, reason: impl fmt::Display) -> Self {
        Self::at(place, format_args!("the metadata cannot be read: {reason}"))
    }

    /// In the place of a column, numbered from 1, something else is found.
    pub(crate) fn column(place: Place, index: usize, column: &str, found: &str) -> Self {
        let expected = format_args!("expected column {index} to be `{column}`, found `{found}`");
        Self::at(place, expected)
    }

    /// What is found is not a row, or not a mark.
    pub(crate) fn not_a(what: &str, place: Place, found: &[u8], reason: impl fmt::Display) -> Self {
        Self::at(place, format_args!("`{}` is not a {what}: {reason}", excerpt(found)))
    }

    /// Whether the file is a recording, of which a part cannot be read.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Read { .. } | Self::Damaged(_))
    }

    /// What to do about it, to follow the error; empty where nothing helps.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        if self.is_damage() {
            "; `haptic-ctl recording repair` keeps what can be read"
        } else {
            ""
        }
    }
}

/// Why a recording cannot be begun.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CreateError {
    /// The file's name says no format.
    #[error(transparent)]
    Format(#[from] UnknownFormat),
    /// The file cannot be created or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's error; [`AlreadyExists`](io::ErrorKind::AlreadyExists) where it is not to
        /// be replaced.
        source: io::Error,
    },
}

/// Why a recording cannot be copied.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CopyError {
    /// The recording cannot be read.
    #[error("{}", at_file(.path, .source))]
    Read {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: RecordingError,
    },
    /// The copy cannot be begun.
    #[error(transparent)]
    Create(#[from] CreateError),
    /// The copy cannot be written.
    #[error("{}: {source}", .path.display())]
    Write {
        /// Its file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A cut would hold nothing.
    #[error("{}: none of its {rows} rows, {length_s} s, is within the cut", .path.display())]
    Empty {
        /// The recording.
        path: PathBuf,
        /// Its rows.
        rows: u64,
        /// Time from its first row to its last, s.
        length_s: f64,
    },
}

/// An error with the name of its file, once.
fn at_file(path: &std::path::Path, error: &RecordingError) -> String {
    match error {
        RecordingError::Open { .. } => error.to_string(),
        error => format!("{}: {error}", path.display()),
    }
}

/// How a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Ended on purpose.
    Complete,
    /// Without an end: it is still being written, or its writer died between two entries.
    Open,
    /// In the middle of an entry, which was left out.
    BrokenOff {
        /// Where that entry begins.
        place: Place,
        /// Bytes of it that are there.
        bytes: u64,
    },
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Complete => f.write_str("complete"),
            Self::Open => f.write_str("without an end: it is still being written, or was broken off between two rows"),
            Self::BrokenOff { place, bytes } => write!(
                f,
                "broken off in {place}, whose {bytes} bytes were left out; every row before it is there"
            ),
        }
    }
}

/// The beginning of what stands in a file, for messages.
pub(crate) fn excerpt(text: &[u8]) -> String {
    const MAX_CHARACTERS: usize = 60;
    let text = String::from_utf8_lossy(text);
    let mut excerpt: String = text.chars().take(MAX_CHARACTERS).flat_map(char::escape_debug).collect();
    if text.chars().count() > MAX_CHARACTERS {
        excerpt.push_str("...");
    }
    excerpt
}
