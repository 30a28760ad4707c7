//! What is compared, from its file.

use crate::derivatives::usual_period_s;
use crate::identify::Record;
use crate::recording::{self, Entry, RecordingError};
use haptic_ipc::{RigState, Sample};
use std::path::Path;

/// A record of the force on a moving mass, and what is known of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The record.
    pub record: Record,
    /// The mass, kg, where a recording says which one was rendered.
    pub mass_kg: Option<f64>,
    /// Remarks for people.
    pub notes: Vec<String>,
}

/// Reads a recording of a rig: the block's motion and the force of its coupling while the rig was
/// engaged, the longest time of all; friction on the device itself moves with the device.
///
/// # Errors
/// It is no recording, or damaged elsewhere than at its end.
pub fn of_recording(path: &Path) -> Result<Source, RecordingError> {
    let mut reader = recording::open(path)?;
    let scene = reader.metadata().scene.clone();
    let is_on_device = scene.is_on_device();
    let (mut longest, mut run): (Vec<Sample>, Vec<Sample>) = (Vec::new(), Vec::new());
    let mut revisions = 0;
    for entry in &mut reader {
        match entry? {
            Entry::Row(row) if row.state == RigState::Engaged => {
                revisions += u64::from(run.last().is_some_and(|last| last.revision != row.revision));
                run.push(row);
            }
            Entry::Row(_) => {
                if run.len() > longest.len() {
                    longest = std::mem::take(&mut run);
                }
                run.clear();
            }
            Entry::Mark(_) => {}
        }
    }
    if run.len() > longest.len() {
        longest = run;
    }
    let mut notes = Vec::new();
    if revisions > 0 {
        notes.push(format!("the scene changed {revisions} times while the rig was engaged"));
    }
    let times: Vec<f64> = longest.iter().map(|row| row.t_s).collect();
    let usual_s = usual_period_s(&times);
    let gaps = times
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > 1.5 * usual_s)
        .count();
    if gaps > 0 {
        notes.push(format!("{gaps} gaps in the recording are bridged by straight lines"));
    }
    let other = |row: &&Sample| (row.command_force_n + row.coupling_force_n).abs() > 1e-6;
    let limited = longest.iter().filter(other).count();
    if limited > 0 {
        notes.push(format!(
            "the motor's force was not the rendered one in {limited} of {} ticks",
            longest.len()
        ));
    }
    let position = |row: &Sample| {
        if is_on_device {
            row.device_position_m
        } else {
            row.block_position_m
        }
    };
    Ok(Source {
        record: Record {
            t_s: times,
            position_m: longest.iter().map(position).collect(),
            force_n: longest.iter().map(|row| row.coupling_force_n).collect(),
            ..Record::default()
        },
        mass_kg: scene.block.map(|block| block.mass),
        notes,
    })
}

pub fn of_csv(path: &Path) -> Option<Source> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).ok()?;
    let header = reader.headers().ok()?.clone();
    let find = |name: &str| header.iter().position(|column| column == name);
    let (t, x, f) = (find("t_s")?, find("position_m")?, find("force_N")?);
    let mut record = Record::default();
    for row in reader.records() {
        let row = row.ok()?;
        let number = |place: usize| row.get(place)?.parse::<f64>().ok();
        record.t_s.push(number(t)?);
        record.position_m.push(number(x)?);
        record.force_n.push(number(f)?);
    }
    Some(Source {
        record,
        ..Source::default()
    })
}
