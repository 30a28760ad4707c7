//! Fitts's law by resistance: movement time against the paper's index of difficulty.

use super::error::{Reason, Refusal};
use super::segments::Segment;
use haptic_lab::stats::mean::clustered_mean;
use haptic_lab::stats::regression::{RegressionLine, line};
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
    /// Its 95 % interval, s, with the subjects as what is independent; absent for one subject.
    pub movement_time_interval_s: Option<[f64; 2]>,
    /// Number of movements.
    pub movements: usize,
}

/// Fitts's law under a resistance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifficultyLine {
    /// Name of the resistance.
    pub resistance: String,
    /// The line through the points, s over bit; absent where they do not determine one.
    pub line: Option<RegressionLine>,
    /// Why there is no line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<Reason>,
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
            let mut times: BTreeMap<&str, (f64, BTreeMap<&str, Vec<f64>>)> = BTreeMap::new();
            for segment in segments.iter().filter(|segment| segment.resistance == *resistance) {
                let (_, times) = times
                    .entry(segment.condition)
                    .or_insert_with(|| (segment.difficulty_bit(), BTreeMap::new()));
                let own = times.entry(segment.subject).or_default();
                own.extend(segment.trials.iter().map(|trial| trial.movement_time_s));
            }
            let mut points: Vec<Point> = times
                .into_iter()
                .map(|(condition, (difficulty_bit, times))| {
                    let times = clustered_mean(&times.into_values().collect::<Vec<_>>());
                    Point {
                        condition: condition.to_owned(),
                        difficulty_bit,
                        movement_time_s: times.value,
                        movement_time_interval_s: times.interval,
                        movements: times.count,
                    }
                })
                .collect();
            points.sort_by(|a, b| a.difficulty_bit.total_cmp(&b.difficulty_bit));
            let through: Vec<[f64; 2]> = points
                .iter()
                .map(|point| [point.difficulty_bit, point.movement_time_s])
                .collect();
            let (line, why) = match line(&through) {
                Ok(line) => (Some(line), None),
                Err(error) => (None, Some(Reason::from(error))),
            };
            refused.extend(why.clone().map(|why| Refusal {
                what: format!("regression of {resistance}"),
                why,
            }));
            DifficultyLine {
                resistance: resistance.clone(),
                line,
                refused: why,
                points,
            }
        })
        .collect()
}
