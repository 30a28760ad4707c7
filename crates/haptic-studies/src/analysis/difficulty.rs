//! Fitts's law by resistance: movement time against the paper's index of difficulty.

use super::error::Refusal;
use super::segments::Segment;
use haptic_lab::stats::mean::mean;
use haptic_lab::stats::regression::{Line, line};
use serde::Serialize;
use std::collections::BTreeMap;

/// The mean of all segments of a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Name of the condition.
    pub condition: String,
    /// Its index of difficulty, bit.
    pub difficulty_bit: f64,
    /// Mean movement time, s.
    pub movement_time_s: f64,
}

/// Fitts's law under a resistance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifficultyLine {
    /// Name of the resistance.
    pub resistance: String,
    /// The line through the points, s over bit; absent where they do not determine one.
    pub line: Option<Line>,
    /// The means by condition, the easiest first.
    pub points: Vec<Point>,
}

/// The line of each resistance, through the means of its conditions.
pub(super) fn by_resistance(
    segments: &[Segment<'_>],
    resistances: &[String],
    refused: &mut Vec<Refusal>,
) -> Vec<DifficultyLine> {
    resistances
        .iter()
        .map(|resistance| {
            let mut times: BTreeMap<&str, (f64, Vec<f64>)> = BTreeMap::new();
            for segment in segments.iter().filter(|segment| segment.resistance == *resistance) {
                let (_, times) = times
                    .entry(segment.condition)
                    .or_insert_with(|| (segment.difficulty_bit(), Vec::new()));
                times.extend(segment.trials.iter().map(|trial| trial.movement_time_s));
            }
            let mut points: Vec<Point> = times
                .into_iter()
                .map(|(condition, (difficulty_bit, times))| Point {
                    condition: condition.to_owned(),
                    difficulty_bit,
                    movement_time_s: mean(&times),
                })
                .collect();
            points.sort_by(|a, b| a.difficulty_bit.total_cmp(&b.difficulty_bit));
            let through: Vec<[f64; 2]> = points
                .iter()
                .map(|point| [point.difficulty_bit, point.movement_time_s])
                .collect();
            let line = line(&through)
                .map_err(|error| {
                    refused.push(Refusal {
                        what: format!("regression of {resistance}"),
                        reason: error.to_string(),
                    });
                })
                .ok();
            DifficultyLine {
                resistance: resistance.clone(),
                line,
                points,
            }
        })
        .collect()
}
