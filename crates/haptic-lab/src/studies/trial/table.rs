//! Rows as CSV.

use super::row::{OutOfRange, Trial};
use std::io::{Read, Write};

/// Why a file of trials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A required column is missing.
    #[error("no column `{0}`")]
    NoColumn(&'static str),
    /// A cell is not what its column holds.
    #[error("line {line}: {column} = `{value}`: {why}")]
    Cell {
        /// Line of the file, from 1.
        line: u64,
        /// The column's name.
        column: String,
        /// The cell.
        value: String,
        /// What is wrong with it.
        why: String,
    },
    /// A value is out of its range.
    #[error("line {line}: {source}")]
    OutOfRange {
        /// Line of the file, from 1.
        line: u64,
        /// Which, and its range.
        source: OutOfRange,
    },
    /// It is not CSV, or cannot be read or written.
    #[error(transparent)]
    Csv(#[from] csv::Error),
}

/// Reads the trials of a file.
///
/// # Errors
/// The file cannot be read, lacks a required column, or has a wrong cell.
pub fn read<T: Trial>(source: impl Read) -> Result<Vec<T>, TrialError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(source);
    let header = reader.headers()?.clone();
    for column in T::REQUIRED {
        if !header.iter().any(|found| found == *column) {
            return Err(TrialError::NoColumn(column));
        }
    }
    let mut trials = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let trial: T = record
            .deserialize(Some(&header))
            .map_err(|error| wrong_cell(line, &header, &record, error))?;
        trial
            .check()
            .map_err(|source| TrialError::OutOfRange { line, source })?;
        trials.push(trial);
    }
    Ok(trials)
}

fn wrong_cell(line: u64, header: &csv::StringRecord, record: &csv::StringRecord, error: csv::Error) -> TrialError {
    let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
        return TrialError::Csv(error);
    };
    let Some(index) = err.field().and_then(|field| usize::try_from(field).ok()) else {
        return TrialError::Csv(error);
    };
    TrialError::Cell {
        line,
        column: header.get(index).unwrap_or_default().to_owned(),
        value: record.get(index).unwrap_or_default().to_owned(),
        why: err.kind().to_string(),
    }
}

/// Writes trials with their header. Numbers are written so that they read back exactly.
///
/// # Errors
/// They cannot be written.
pub fn write<T: Trial>(trials: &[T], sink: impl Write) -> Result<(), TrialError> {
    let mut writer = csv::Writer::from_writer(sink);
    for trial in trials {
        writer.serialize(trial)?;
    }
    writer.flush().map_err(csv::Error::from)?;
    Ok(())
}

/// A trial as a line of a file, with its end; before the first one stands the header.
///
/// # Errors
/// It cannot be written as CSV.
pub fn line<T: Trial>(trial: &T, with_header: bool) -> Result<Vec<u8>, TrialError> {
    let mut bytes = Vec::new();
    let mut writer = csv::WriterBuilder::new()
        .has_headers(with_header)
        .from_writer(&mut bytes);
    writer.serialize(trial)?;
    writer.flush().map_err(csv::Error::from)?;
    drop(writer);
    Ok(bytes)
}
