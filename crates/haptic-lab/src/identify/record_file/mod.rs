//! Reads a record of any laboratory: columns by name, units by gains, two recorders by two files.
//!
//! A file of text has a heading, perhaps a line of units, then a row of numbers for each sample. Cells are separated by
//! commas, semicolons, tabs or spaces; lines of `#`, `%` or `//` and whatever a program writes above the heading are
//! remarks. A comma is a decimal point where it does not separate. Times may be times of day. Columns are found by
//! their usual names, or named; without a heading they are named by their numbers, from 1. A data frame in Parquet is
//! read as such a table, with numbers of any type and moments as times.
//!
//! A recording of hapticd is read as one, in any of its formats. What moves is then
//! - the block, in a scene with one, while the rig was engaged: the columns `block_position_m` and
//!   `coupling_force_N`, the force in the coupling, which drives the block. It is computed, so that its
//!   offset is 0;
//! - the rig's own carriage, moved by its own motor, where that is asked for or the scene has no block:
//!   `device_position_m` and `command_force_N`, the force that the device applies, positive along its axis.
//!
//! Of a recording in which the scene changed, the longest stretch under one scene is read.

mod columns;
mod from_recording;
mod layout;
mod parquet_table;
mod table;

pub use columns::Columns;

use super::Record;
use from_recording::Beginning;
use haptic_recording::{Place, Recording};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Which mass a recording of hapticd is to tell of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MovingMass {
    /// The block, where the scene has one and the rig was engaged; else the device.
    #[default]
    Auto,
    /// The virtual block, driven by its coupling.
    Block,
    /// The device's own carriage, driven by its motor.
    Device,
}

/// Where a record is, and how it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Another file that holds the forces, on a clock of its own.
    pub force_path: Option<PathBuf>,
    /// Names of columns.
    pub columns: Columns,
    /// Newtons a unit of the force column; negative where the sensor points the other way. `None` for
    /// the unit that the column's name tells, or N.
    pub force_gain: Option<f64>,
    /// Metres a unit of the position column; `None` for the unit that the column's name tells, or m.
    pub position_gain: Option<f64>,
    /// What a recording of hapticd is to tell of.
    pub moving: MovingMass,
}

impl Source {
    /// A file whose columns have their usual names, in SI units.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            force_path: None,
            columns: Columns::default(),
            force_gain: None,
            position_gain: None,
            moving: MovingMass::Auto,
        }
    }
}

/// A record with what was seen while it was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The record.
    pub record: Record,
    /// The constant force, N, where it is known: that of a computed force is 0.
    pub offset_n: Option<f64>,
    /// Whether positions and forces are known to be of one clock.
    pub has_one_clock: bool,
    /// Which columns were read, and what was left out.
    pub notes: Vec<String>,
}

/// Why a record cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordFileError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A recording of hapticd is damaged.
    #[error("{}: {source}", .path.display())]
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
    /// A column is missing.
    #[error("{}: no {what} column among `{header}`: name it with {option} (usual names: {usual})", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// What it holds.
        what: &'static str,
        /// The option that names it.
        option: &'static str,
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
    /// Another program wrote it, in a format that is read of hapticd alone.
    #[error("{}: hapticd did not write this MCAP file; tables of other programs are read from CSV and \
             Parquet", .path.display())]
    OtherMcap {
        /// The file.
        path: PathBuf,
    },
    /// The file is neither text nor a recording.
    #[error("{}: neither a table of text nor a recording of hapticd", .path.display())]
    NotText {
        /// The file.
        path: PathBuf,
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
    /// Columns of a recording that is not text are named.
    #[error("{}: the columns of a recording in MCAP or Parquet cannot be named, nor those of another MCAP file; \
             `haptic-ctl recording export` makes CSV of a recording", .path.display())]
    NoTable {
        /// The file.
        path: PathBuf,
    },
    /// A name is there twice.
    #[error("{}: {count} columns are named `{column}`", .path.display())]
    DoubledColumn {
        /// The file.
        path: PathBuf,
        /// The name.
        column: String,
        /// How often it is there.
        count: usize,
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
    /// Time goes back.
    #[error("{}, {place}: time goes back from {before_s} s to {t_s} s: sort the rows by time", .path.display())]
    TimeGoesBack {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// Time there, s.
        t_s: f64,
        /// Time in the row before, s.
        before_s: f64,
    },
    /// The two files have no time in common.
    #[error("{} and {} have less than 1 s in common", .path.display(), .force_path.display())]
    Apart {
        /// The file of positions.
        path: PathBuf,
        /// The file of forces.
        force_path: PathBuf,
    },
    /// A gain cannot be.
    #[error("{option} = {value} is not a finite number other than 0")]
    Gain {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Reads a record.
///
/// # Errors
/// A file or a cell of it cannot be read, or a column is missing; the error says where.
pub fn read(source: &Source) -> Result<Loaded, RecordFileError> {
    check_gains(source)?;
    let beginning = from_recording::beginning(&source.path)?;
    let is_recording = beginning.is_some() && source.columns == Columns::default();
    let no_meaning = |option, reason| {
        Err(RecordFileError::NoMeaning {
            option,
            path: source.path.clone(),
            reason,
        })
    };
    if is_recording && source.force_path.is_some() {
        return no_meaning("--force-file", "a recording of hapticd holds its own forces");
    }
    if !is_recording && source.moving != MovingMass::Auto {
        return no_meaning("--moving", "it chooses between the masses of a recording of hapticd");
    }
    Ok(with_velocity_note(match beginning {
        Some(Beginning::Text) if source.columns != Columns::default() => table::read(source)?,
        Some(Beginning::Binary) if source.columns != Columns::default() => {
            return Err(RecordFileError::NoTable {
                path: source.path.clone(),
            });
        }
        Some(_) => from_recording::read(source)?,
        None => table::read(source)?,
    }))
}

/// Takes a recording of hapticd that is in memory. The path of `source` is its name in errors.
///
/// # Errors
/// It holds nothing of what was asked for.
pub fn take(recording: &Recording, source: &Source) -> Result<Loaded, RecordFileError> {
    check_gains(source)?;
    Ok(with_velocity_note(from_recording::take(recording, source)?))
}

/// The names of the columns of a file of text; `None` for a recording of hapticd, whose columns are known.
///
/// # Errors
/// The file cannot be read, or has no heading.
pub fn headings(path: &Path) -> Result<Option<Vec<String>>, RecordFileError> {
    match from_recording::beginning(path)? {
        Some(_) => Ok(None),
        None => table::headings(path).map(Some),
    }
}

fn check_gains(source: &Source) -> Result<(), RecordFileError> {
    for (option, value) in [
        ("--force-gain", source.force_gain),
        ("--position-gain", source.position_gain),
    ] {
        if let Some(value) = value.filter(|value| !value.is_finite() || *value == 0.0) {
            return Err(RecordFileError::Gain { option, value });
        }
    }
    Ok(())
}

fn with_velocity_note(mut loaded: Loaded) -> Loaded {
    loaded.notes.extend(velocity_note(&loaded.record));
    loaded
}

/// Says where the velocities are not those of the positions: a unit, a sign or a gain is wrong.
fn velocity_note(record: &Record) -> Option<String> {
    let velocity = record.velocity_mps.as_ref()?;
    let (mut product, mut square) = (0.0, 0.0);
    let last = record.t_s.len().checked_sub(16)?;
    for (index, velocity) in velocity.iter().skip(8).take(last).enumerate() {
        let width_s = record.t_s[index + 16] - record.t_s[index];
        let slope = (record.position_m[index + 16] - record.position_m[index]) / width_s;
        product += slope * velocity;
        square += slope * slope;
    }
    let ratio = product / square;
    ((ratio - 1.0).abs() > 0.05).then(|| {
        format!(
            "the velocity column is {ratio:.4} times the slope of the positions: check units, signs and gains; the \
                 slope is used"
        )
    })
}

#[cfg(test)]
mod tests;
