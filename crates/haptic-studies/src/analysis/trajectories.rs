//! Single movements over time, as in the paper's Figures 8 and 9, from the recordings of the trials.

use super::segments::{Segment, resistances, segments};
use super::{AnalysisError, FittsTrial};
use haptic_motion::{MotionError, Rows};
use serde::Serialize;
use std::path::Path;

/// One movement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trajectory {
    /// Code of the subject.
    pub subject: String,
    /// Name of the resistance.
    pub resistance: String,
    /// Name of the condition.
    pub condition: String,
    /// Number of the trial.
    pub trial: u32,
    /// Time since the recording's beginning (s), and how far the handle has gone along the movement (m).
    pub points: Vec<[f64; 2]>,
}

/// A movement under each resistance in the easiest and in the hardest condition: those of the first subject that has
/// recordings there, in the last block, in the middle of the segment. A recording that cannot be read is left out, and
/// reported in the second value. The baseline comes first.
///
/// # Errors
/// As [`fitts`](super::fitts).
pub fn trajectories(
    folder: &Path,
    trials: &[FittsTrial],
    baseline: &str,
) -> Result<(Vec<Trajectory>, Vec<String>), AnalysisError> {
    let all = segments(trials)?;
    let has_recording = |segment: &&Segment<'_>| segment.trials.iter().any(|trial| trial.recording.is_some());
    let mut recorded: Vec<&Segment<'_>> = all.iter().filter(has_recording).collect();
    recorded.sort_by(|a, b| a.difficulty_bit().total_cmp(&b.difficulty_bit()));
    let mut conditions: Vec<&str> = [recorded.first(), recorded.last()]
        .into_iter()
        .flatten()
        .map(|segment| segment.condition)
        .collect();
    conditions.dedup();
    let (mut found, mut notes) = (Vec::new(), Vec::new());
    for condition in conditions {
        let own: Vec<&&Segment<'_>> = recorded.iter().filter(|one| one.condition == condition).collect();
        let Some(subject) = own.iter().map(|one| one.subject).min() else {
            continue;
        };
        for resistance in resistances(&all, baseline) {
            let of = own
                .iter()
                .filter(|one| one.subject == subject && one.resistance == resistance);
            let Some(segment) = of.max_by_key(|one| one.block) else {
                continue;
            };
            let trial = segment.trials[segment.trials.len() / 2];
            let Some(recording) = &trial.recording else {
                continue;
            };
            match points(&folder.join(recording), trial.direction) {
                Ok(points) => found.push(Trajectory {
                    subject: subject.to_owned(),
                    resistance,
                    condition: condition.to_owned(),
                    trial: trial.trial,
                    points,
                }),
                Err(error) => notes.push(format!("no trajectory of {}: {error}", segment.name())),
            }
        }
    }
    Ok((found, notes))
}

/// The course of a recording. Without a direction, the movement goes to where it ends.
fn points(path: &Path, direction: Option<i8>) -> Result<Vec<[f64; 2]>, MotionError> {
    let rows: Vec<[f64; 2]> = Rows::open(path)?
        .map(|row| row.map(|row| [row.t_s, row.position_m]))
        .collect::<Result<_, _>>()?;
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Ok(Vec::new());
    };
    let sign = direction.map_or((last[1] - first[1]).signum(), f64::from);
    Ok(rows
        .iter()
        .map(|[t_s, x_m]| [t_s - first[0], sign * (x_m - first[1])])
        .collect())
}
