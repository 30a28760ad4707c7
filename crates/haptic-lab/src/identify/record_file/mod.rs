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

mod error;
mod from_recording;
mod source;
mod tables;

pub use error::RecordFileError;
pub use source::{MovingMass, Source};

use super::record::Record;
use from_recording::Beginning;
use haptic_motion::table::{self, Columns, TableError};
use haptic_recording::Recording;
use std::path::Path;

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
    let beginning = from_recording::beginning(&source.path)?;
    let is_recording = beginning.is_some() && source.table.columns == Columns::default();
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
    Ok(with_velocity_note(match beginning {
        Some(Beginning::Text) if source.table.columns != Columns::default() => tables::read(source)?,
        Some(Beginning::Binary) if source.table.columns != Columns::default() => {
            let path = source.path.clone();
            return Err(TableError::NoTable { path }.into());
        }
        Some(_) => from_recording::read(source)?,
        None => tables::read(source)?,
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

/// The names of the columns of a file of text; `None` for a recording of hapticd, whose columns are known.
///
/// # Errors
/// The file cannot be read, or has no heading.
pub fn headings(path: &Path) -> Result<Option<Vec<String>>, RecordFileError> {
    match from_recording::beginning(path)? {
        Some(_) => Ok(None),
        None => Ok(Some(table::headings(path)?)),
    }
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
