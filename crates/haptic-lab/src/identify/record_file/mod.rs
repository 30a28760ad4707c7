//! Reads a record of any laboratory: columns by name, units by gains, two recorders by two files.
//!
//! Tables of other programs are read as [`haptic_motion::table`] says.
//!
//! A recording of hapticd is read as one, in any of its formats. What moves is then
//! - the block, in a scene with one, while the rig was engaged: the columns `block_position_m` and
//!   `coupling_force_N`, the force in the coupling, which drives the block. It is computed, so that its
//!   offset is 0;
//! - the rig's own carriage, moved by its own motor, where that is asked for or the scene has no block:
//!   `device_position_m` and `command_force_N`, the force that the device applies, positive along its axis.
//!
//! Of a recording in which the scene changed, the longest stretch under one scene is read.
//!
//! A source says where a record is and how it is read: files, columns, gains, and which mass of a recording.

mod error;
mod from_recording;
mod tables;

pub use error::RecordFileError;

use super::options::Record;
use haptic_motion::Opened;
use haptic_motion::table::{self, Columns, TableOptions};
use haptic_recording::Recording;
use std::path::{Path, PathBuf};

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
    /// Whether positions and forces are known to be of one clock.
    pub has_one_clock: bool,
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
        Err(RecordFileError::NoMeaning {
            option,
            path: source.path.clone(),
            reason,
        })
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
        tables::read(source, file)?
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

#[cfg(test)]
mod tests;
