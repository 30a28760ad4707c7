//! Reads a record of any laboratory: columns by name, units by gains, two recorders by two files.
//!
//! Tables of other programs are read as [`haptic_motion::table`] says.
//!
//! A recording of hapticd is read as one, in any of its formats. What moves is then
//! - the block, in a scene with one, while the rig was engaged: the columns `block_position_m` and
//!   `coupling_force_N`, the force in the coupling, which drives the block. It is computed, so that its
//!   offset is 0;
//! - the rig's own carriage, moved by its own motor, where that is asked for or the scene has no block:
//!   `sample_position_m` and `command_force_N`, the force that the device is sent, positive along its axis. It acts
//!   after its command.
//!
//! Of a recording in which the scene changed, the longest stretch under one scene is read.
//!
//! A source says where a record is and how it is read: files, columns, gains, and which mass of a recording.

mod from_recording;

pub use from_recording::of_device;

use super::options::{Clocks, Record};
use crate::gaps::in_gaps;
use crate::motion::{between, places};
use haptic_motion::Opened;
use haptic_motion::table::{self, Columns, Quantity, Table, TableError, TableOptions};
use haptic_recording::Recording;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Which mass of a recording of hapticd is read.
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
    /// Names of columns, gains and the unit of times.
    pub table: TableOptions,
    /// The mass of a recording of hapticd.
    pub moving: MovingMass,
}

impl Source {
    /// A file whose columns have their usual names, in SI units.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            force_path: None,
            table: TableOptions::default(),
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
    /// The clocks, where they are known.
    pub clocks: Option<Clocks>,
    /// Which columns were read, and what was left out.
    pub notes: Vec<String>,
}

/// Reads a record.
///
/// # Errors
/// A file or a cell of it cannot be read, or a column is missing; the error says where.
pub fn read(source: &Source) -> Result<Loaded, RecordFileError> {
    source.table.check_gains()?;
    let file = Opened::open(&source.path)?;
    let is_recording = file.is_recording() && source.table.columns == Columns::default();
    let no_meaning = |option, reason| {
        let path = source.path.display();
        Err(RecordFileError::Unusable(format!(
            "{option} has no meaning for {path}: {reason}"
        )))
    };
    if is_recording && source.force_path.is_some() {
        return no_meaning("--force-file", "a recording of hapticd holds its own forces");
    }
    if is_recording && source.table.time_unit_s.is_some() {
        return no_meaning("--time-unit", "a recording of hapticd has its times in seconds");
    }
    if !is_recording && source.moving != MovingMass::Auto {
        return no_meaning("--moving", "it chooses between the masses of a recording of hapticd");
    }
    Ok(with_velocity_note(if is_recording {
        from_recording::read(source)?
    } else {
        of_tables(source, file)?
    }))
}

/// Takes a recording of hapticd that is in memory. The path of `source` is its name in errors.
///
/// # Errors
/// It holds nothing of what was asked for.
pub fn take(recording: &Recording, source: &Source) -> Result<Loaded, RecordFileError> {
    source.table.check_gains()?;
    Ok(with_velocity_note(from_recording::take(recording, source)?))
}

/// The names of the columns of a file; `None` for a recording of hapticd, whose columns are known.
///
/// # Errors
/// The file cannot be read, or has no heading.
pub fn headings(path: &Path) -> Result<Option<Vec<String>>, RecordFileError> {
    Ok(table::headings(path)?)
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

/// Shortest time that two files must have in common, s.
const MIN_COMMON_S: f64 = 1.0;

/// Reads an opened file, or one of positions and another of forces.
fn of_tables(source: &Source, file: Opened) -> Result<Loaded, RecordFileError> {
    use Quantity::{Force, Position, Velocity};
    let Some(force_path) = &source.force_path else {
        let mut table = Table::read(&source.path, file, &source.table, &[Position, Velocity, Force])?;
        let force_n = table.values.pop().unwrap_or_default();
        return Ok(loaded(table, force_n));
    };
    let mut forces = Table::read(force_path, Opened::open(force_path)?, &source.table, &[Force])?;
    let mut table = Table::read(&source.path, file, &source.table, &[Position, Velocity])?;
    for (path, table) in [(&source.path, &table), (force_path, &forces)] {
        if let Some(place) = table.second_take {
            return Err(RecordFileError::Unusable(format!(
                "{}, {place}: the clock falls back, as one that was reset or a second take, so that it is not known which \
                 rows of the other file are of the same time: give each take as a file of its own",
                path.display()
            )));
        }
    }
    let (begin, end) = common(&table.t_s, &forces.t_s);
    if end - begin < MIN_COMMON_S {
        // Clocks that count from their own starts: the starts are taken as the same instant.
        let ahead = forces.t_s.first().unwrap_or(&0.0) - table.t_s.first().unwrap_or(&0.0);
        forces.t_s.iter_mut().for_each(|t| *t -= ahead);
        table.notes.push(format!(
            "the files have no time in common: the forces begin {ahead} s later, and are moved to the beginning"
        ));
    }
    let (begin, end) = common(&table.t_s, &forces.t_s);
    if end - begin < MIN_COMMON_S {
        return Err(RecordFileError::Unusable(format!(
            "{} and {} have less than 1 s in common",
            source.path.display(),
            force_path.display()
        )));
    }
    let is_common: Vec<bool> = table.t_s.iter().map(|t| (begin..=end).contains(t)).collect();
    table.retain(&is_common);
    table.notes.append(&mut forces.notes);
    let is_in_gap = in_gaps(&forces.t_s, table.t_s.iter().copied(), 0.0);
    let lacking = is_in_gap.iter().filter(|is_in_gap| **is_in_gap).count();
    if lacking > 0 {
        table.notes.push(format!(
            "{lacking} rows lie in gaps of {}: left out",
            force_path.display()
        ));
        table.retain(&is_in_gap.iter().map(|is_in_gap| !is_in_gap).collect::<Vec<bool>>());
    }
    let force_n = at_times(&table.t_s, &forces.t_s, &forces.values[0]);
    Ok(loaded(table, force_n))
}

fn loaded(mut table: Table, force_n: Vec<f64>) -> Loaded {
    let velocity = table.values.pop().filter(|values| !values.is_empty());
    Loaded {
        record: Record {
            t_s: table.t_s,
            position_m: table.values.pop().unwrap_or_default(),
            velocity_mps: velocity,
            force_n,
            resolution_m: None,
        },
        offset_n: None,
        clocks: None,
        notes: table.notes,
    }
}

/// The time that two records have in common, s.
fn common(a: &[f64], b: &[f64]) -> (f64, f64) {
    let of = |t: &[f64]| (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(0.0));
    let ((a_begin, a_end), (b_begin, b_end)) = (of(a), of(b));
    (a_begin.max(b_begin), a_end.min(b_end))
}

/// Values at other times. Where several lie between two of those, their mean: a faster recorder's noise is
/// not taken for its signal.
fn at_times(times: &[f64], t_s: &[f64], values: &[f64]) -> Vec<f64> {
    times
        .iter()
        .zip(places(t_s, times.iter().copied()))
        .enumerate()
        .map(|(index, (t, place))| {
            let half = |other: Option<&f64>| other.map_or(0.0, |other| (other - t).abs() / 2.0);
            let before = half(index.checked_sub(1).and_then(|before| times.get(before)));
            let low = t_s.partition_point(|other| *other < t - before);
            let high = t_s.partition_point(|other| *other < t + half(times.get(index + 1)));
            if high >= low + 2 {
                return values[low..high].iter().sum::<f64>() / (high - low) as f64;
            }
            between(values, place)
        })
        .collect()
}

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
    /// A file holds nothing of what was asked for, or not in a way that can be read: which, and why.
    #[error("{0}")]
    Unusable(String),
}

#[cfg(test)]
mod tests;
