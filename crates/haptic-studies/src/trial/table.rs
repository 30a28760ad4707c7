//! Rows as CSV.

use super::row::{OutOfRange, Trial};
use csv::DeserializeErrorKind;
use std::io::{Read, Write};

/// Why a file of trials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// It has no heading.
    #[error("it is empty: its first line must name the columns")]
    Empty,
    /// Its cells are not separated by commas.
    #[error("its columns are separated by {0}: write it with commas between them, and points in its numbers")]
    Separator(&'static str),
    /// A required column is missing.
    #[error("no column `{column}`{}", in_another_unit(column, .found.as_deref()))]
    NoColumn {
        /// Its name.
        column: &'static str,
        /// A column of the same quantity in another unit, where there is one.
        found: Option<String>,
    },
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
    check_separator(&header)?;
    for column in T::REQUIRED {
        if !header.iter().any(|found| found == *column) {
            let found = header.iter().find(|found| is_other_unit(column, found));
            let found = found.map(str::to_owned);
            return Err(TrialError::NoColumn { column, found });
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

fn check_separator(header: &csv::StringRecord) -> Result<(), TrialError> {
    let mut names = header.iter();
    match (names.next(), names.next()) {
        (None | Some(""), None) => Err(TrialError::Empty),
        (Some(all), None) if all.contains(';') => Err(TrialError::Separator("semicolons")),
        (Some(all), None) if all.contains('\t') => Err(TrialError::Separator("tabs")),
        _ => Ok(()),
    }
}

/// Whether two columns have one quantity in two units: `width_m` and `width_mm`.
fn is_other_unit(column: &str, found: &str) -> bool {
    let Some((quantity, _)) = column.rsplit_once('_') else {
        return false;
    };
    let rest = found.strip_prefix(quantity);
    rest.is_some_and(|rest| rest.is_empty() || (rest.starts_with('_') && !rest[1..].contains('_')))
}

fn in_another_unit(column: &str, found: Option<&str>) -> String {
    let unit = column.rsplit('_').next().unwrap_or_default();
    found.map_or_else(String::new, |found| format!(", but `{found}`: convert it to {unit}"))
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
        why: match err.kind() {
            DeserializeErrorKind::ParseFloat(_) => "it must be a number, as in 0.6".to_owned(),
            DeserializeErrorKind::ParseInt(_) => "it must be a whole number; counts are not below 0".to_owned(),
            DeserializeErrorKind::ParseBool(_) => "it must be true or false".to_owned(),
            other => other.to_string(),
        },
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
