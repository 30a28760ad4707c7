//! A record from one table, or from two of two recorders.

use super::error::RecordFileError;
use super::{Loaded, Source};
use crate::identify::options::Record;
use haptic_motion::Opened;
use haptic_motion::table::{Quantity, Table};

/// Shortest time that two files must have in common, s.
const MIN_COMMON_S: f64 = 1.0;

/// Reads an opened file, or one of positions and another of forces.
pub(super) fn read(source: &Source, file: Opened) -> Result<Loaded, RecordFileError> {
    use Quantity::{Force, Position, Velocity};
    let Some(force_path) = &source.force_path else {
        let mut table = Table::read(&source.path, file, &source.table, &[Position, Velocity, Force])?;
        let force_n = table.values.pop().unwrap_or_default();
        return Ok(loaded(table, force_n));
    };
    let mut forces = Table::read(force_path, Opened::open(force_path)?, &source.table, &[Force])?;
    let mut table = Table::read(&source.path, file, &source.table, &[Position, Velocity])?;
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
        return Err(RecordFileError::Apart {
            path: source.path.clone(),
            force_path: force_path.clone(),
        });
    }
    let is_common: Vec<bool> = table.t_s.iter().map(|t| (begin..=end).contains(t)).collect();
    table.retain(&is_common);
    table.notes.append(&mut forces.notes);
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
        has_one_clock: false,
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
    let mut next = 0;
    times
        .iter()
        .enumerate()
        .map(|(index, t)| {
            let half = |other: Option<&f64>| other.map_or(0.0, |other| (other - t).abs() / 2.0);
            let before = half(index.checked_sub(1).and_then(|before| times.get(before)));
            let low = t_s.partition_point(|other| *other < t - before);
            let high = t_s.partition_point(|other| *other < t + half(times.get(index + 1)));
            if high >= low + 2 {
                return values[low..high].iter().sum::<f64>() / (high - low) as f64;
            }
            while next + 2 < t_s.len() && t_s[next + 1] <= *t {
                next += 1;
            }
            let share = ((t - t_s[next]) / (t_s[next + 1] - t_s[next])).clamp(0.0, 1.0);
            values[next] + share * (values[next + 1] - values[next])
        })
        .collect()
}
