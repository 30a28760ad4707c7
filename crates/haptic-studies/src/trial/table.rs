//! Rows as CSV.

use super::row::{Column, Trial};
use csv::DeserializeErrorKind;
use haptic_motion::text::decoded;
use std::io::Write;

/// Why a file of trials cannot be used, with the line and the column where it is of one.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct TrialError(String);

impl From<csv::Error> for TrialError {
    fn from(error: csv::Error) -> Self {
        Self(error.to_string())
    }
}

/// Reads the trials of a file of text. Commas, semicolons or tabs separate its cells; where commas do not, they are
/// decimal points.
///
/// # Errors
/// The file lacks a required column, or has a wrong cell.
pub fn read<T: Trial>(bytes: &[u8]) -> Result<Vec<T>, TrialError> {
    let text = text_of(bytes)?;
    let separator = separator(&text);
    let mut reader = reader(&text, separator);
    let header = reader.headers()?.clone();
    if header.iter().all(str::is_empty) {
        let why = "it is empty: its first line must name the columns";
        return Err(TrialError(why.to_owned()));
    }
    let required = T::COLUMNS.iter().filter(|column| column.is_required);
    let missing = required.filter(|column| !header.iter().any(|found| found == column.name));
    // Each with the column of the same quantity in another unit, where there is one.
    let missing = missing.map(|&Column { name, .. }| {
        let found = header.iter().find(|found| is_other_unit(name, found));
        let unit = name.rsplit('_').next().unwrap_or_default();
        let found = found.map_or_else(String::new, |found| format!(" (but `{found}`: convert it to {unit})"));
        format!("`{name}`{found}")
    });
    let missing: Vec<String> = missing.collect();
    if !missing.is_empty() {
        return Err(TrialError(format!("no column {}", missing.join(", "))));
    }
    let mut trials = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let cells = header.iter().zip(&record).map(|(column, cell)| {
            if T::COLUMNS.iter().any(|known| known.is_truth && known.name == column) {
                truth(cell)
            } else if separator == b',' {
                cell.to_owned()
            } else {
                with_point(cell)
            }
        });
        let record: csv::StringRecord = cells.collect();
        let trial: T = record
            .deserialize(Some(&header))
            .map_err(|error| wrong_cell(line, &header, &record, error))?;
        trial
            .check()
            .map_err(|error| TrialError(format!("line {line}: {error}")))?;
        trials.push(trial);
    }
    Ok(trials)
}

/// The cells of a file of text, its heading first.
pub(crate) fn cells(bytes: &[u8]) -> Result<Vec<Vec<String>>, TrialError> {
    let text = text_of(bytes)?;
    let mut reader = reader(&text, separator(&text));
    let heading = reader.headers()?.clone();
    let rows: Result<Vec<csv::StringRecord>, csv::Error> =
        std::iter::once(Ok(heading)).chain(reader.records()).collect();
    let cells = |row: &csv::StringRecord| row.iter().map(str::to_owned).collect();
    Ok(rows?.iter().map(cells).collect())
}

fn text_of(bytes: &[u8]) -> Result<String, TrialError> {
    let none = || TrialError("neither a table of text nor of Parquet".to_owned());
    decoded(bytes).ok_or_else(none)
}

/// The names of the columns of a file of text; none where it is none.
pub(crate) fn heading(bytes: &[u8]) -> Vec<String> {
    let text = decoded(bytes).unwrap_or_default();
    let mut reader = reader(&text, separator(&text));
    let names = reader.headers().map(|names| names.iter().map(str::to_owned).collect());
    names.unwrap_or_default()
}

fn reader(text: &str, separator: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .delimiter(separator)
        .from_reader(text.as_bytes())
}

/// What separates the columns' names.
fn separator(text: &str) -> u8 {
    let heading = text.lines().next().unwrap_or_default();
    let all = [b',', b';', b'\t'];
    let found = all
        .into_iter()
        .find(|&separator| heading.contains(char::from(separator)));
    found.unwrap_or(b',')
}

/// A yes or no as one program writes it, of those that others write; anything else as it is.
fn truth(cell: &str) -> String {
    let word = cell.to_ascii_lowercase();
    match &*word {
        "1" | "true" => "true".to_owned(),
        "0" | "false" => "false".to_owned(),
        _ => cell.to_owned(),
    }
}

/// A number with a decimal point; anything else as it is.
fn with_point(cell: &str) -> String {
    let pointed = cell.replacen(',', ".", 1);
    if pointed.parse::<f64>().is_ok() {
        pointed
    } else {
        cell.to_owned()
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

fn wrong_cell(line: u64, header: &csv::StringRecord, record: &csv::StringRecord, error: csv::Error) -> TrialError {
    let csv::ErrorKind::Deserialize { err, .. } = error.kind() else {
        return error.into();
    };
    let Some(index) = err.field().and_then(|field| usize::try_from(field).ok()) else {
        return error.into();
    };
    let [column, value] = [header, record].map(|cells| cells.get(index).unwrap_or_default());
    let why = match err.kind() {
        DeserializeErrorKind::ParseFloat(_) => "it must be a number, as in 0.6".to_owned(),
        DeserializeErrorKind::ParseBool(_) => "it must be true or false, or 1 or 0".to_owned(),
        DeserializeErrorKind::ParseInt(_) => "it must be a whole number; counts are not below 0".to_owned(),
        other => other.to_string(),
    };
    TrialError(format!("line {line}: {column} = `{value}`: {why}"))
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
