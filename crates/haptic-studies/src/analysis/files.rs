//! The trials of a study's folder, or of a file from elsewhere.
//!
//! A study may be under way: the last line of a file of its folder counts only if it has an end.

use crate::trial::{self, FittsTrial, PerceptionTrial, TrialError};
use haptic_motion::guard::guarded;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A column that the answers of a perception test alone have.
const PERCEPTION_COLUMN: &str = "level_N";

/// The first bytes of a table of Parquet.
const PARQUET: &[u8] = b"PAR1";

/// The trials of one task.
#[derive(Clone, Debug, PartialEq)]
pub enum Trials {
    /// Of the targeting task.
    Fitts(Vec<FittsTrial>),
    /// Of a perception test.
    Perception(Vec<PerceptionTrial>),
}

/// Why trials cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// A file or folder cannot be read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// Its name.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file's rows are wrong.
    #[error("{path}: {source}", path = path.display())]
    Rows {
        /// Its name.
        path: PathBuf,
        /// What is wrong.
        source: TrialError,
    },
    /// A table of Parquet cannot be read.
    #[error("{path}: {reason}", path = path.display())]
    Parquet {
        /// Its name.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A folder has no data.
    #[error("{path}: no trials: a study has them in data/subject-CODE/, in files that end in _data.csv", path = path.display())]
    NoData {
        /// Its name.
        path: PathBuf,
    },
    /// A folder has trials of both tasks.
    #[error("{path}: answers of a perception test beside trials of a targeting task: analyse each alone", path = path.display())]
    BothTasks {
        /// The first file of the other task.
        path: PathBuf,
    },
}

/// Reads a file of trials, of text or Parquet. Its columns show the task.
///
/// # Errors
/// It cannot be read, or a row is wrong.
pub fn read_file(path: &Path) -> Result<Trials, ReadError> {
    let bytes = bytes(path)?;
    if !bytes.starts_with(PARQUET) {
        return rows(path, &bytes);
    }
    let text = guarded(|| of_parquet(path)).map_err(|reason| ReadError::Parquet {
        path: path.to_path_buf(),
        reason,
    })?;
    rows(path, &text)
}

fn bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(|source| ReadError::Io {
        path: path.to_path_buf(),
        source,
    })
}

/// A table of Parquet as CSV.
fn of_parquet(path: &Path) -> parquet::errors::Result<Vec<u8>> {
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| ParquetError::External(Box::new(error));
    writer
        .write_record(schema.columns().iter().map(|column| column.name()))
        .map_err(failed)?;
    for row in reader.get_row_iter(None)? {
        let row = row?;
        let cells = row.get_column_iter().map(|(_, cell)| match cell {
            Field::Null => String::new(),
            Field::Str(text) => text.clone(),
            other => other.to_string(),
        });
        writer.write_record(cells).map_err(failed)?;
    }
    writer
        .into_inner()
        .map_err(|error| ParquetError::External(Box::new(error.into_error())))
}

fn rows(path: &Path, text: &[u8]) -> Result<Trials, ReadError> {
    let read = if trial::heading(text).iter().any(|name| name == PERCEPTION_COLUMN) {
        trial::read(text).map(Trials::Perception)
    } else {
        trial::read(text).map(Trials::Fitts)
    };
    read.map_err(|source| ReadError::Rows {
        path: path.to_path_buf(),
        source,
    })
}

/// Reads all trials of a study's folder.
///
/// # Errors
/// A file cannot be read or has a wrong row, or there are no trials, or those of both tasks.
pub fn read_folder(folder: &Path) -> Result<Trials, ReadError> {
    let mut paths = Vec::new();
    let data = folder.join("data");
    // A study has none before its first trial.
    if data.exists() || !folder.is_dir() {
        find(&data, &mut paths).map_err(|(path, source)| ReadError::Io { path, source })?;
    }
    paths.sort();
    let mut all: Option<Trials> = None;
    for path in paths {
        let text = bytes(&path)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        if whole == 0 {
            continue;
        }
        match (&mut all, rows(&path, &text[..whole])?) {
            (none @ None, read) => *none = Some(read),
            (Some(Trials::Fitts(trials)), Trials::Fitts(more)) => trials.extend(more),
            (Some(Trials::Perception(trials)), Trials::Perception(more)) => trials.extend(more),
            _ => return Err(ReadError::BothTasks { path }),
        }
    }
    all.ok_or_else(|| ReadError::NoData {
        path: folder.to_path_buf(),
    })
}

/// The files of trials in a folder and those below it.
fn find(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), (PathBuf, io::Error)> {
    let failed = |source| (folder.to_path_buf(), source);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() {
            find(&path, paths)?;
        } else if path
            .file_name()
            .is_some_and(|name| name.to_string_lossy().ends_with("_data.csv"))
        {
            paths.push(path);
        }
    }
    Ok(())
}
