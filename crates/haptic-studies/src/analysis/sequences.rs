//! ISO 9241-411 by sequence, and the mean over sequences.

use super::error::Refusal;
use super::segments::Segment;
use crate::trial::FittsTrial;
use haptic_lab::stats::mean::{clustered_mean, mean};
use haptic_lab::stats::throughput::{Movement, Task, Throughput, throughput};
use serde::Serialize;
use std::collections::BTreeMap;

/// The throughput of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sequence {
    /// Code of the subject.
    pub subject: String,
    /// Segment of the subject's study.
    pub block: u32,
    /// Name of the resistance.
    pub resistance: String,
    /// Name of the condition.
    pub condition: String,
    /// Number of movements.
    pub trials: usize,
    /// Share of the movements with an invalid click, or with an end more than half the target's width beside its
    /// centre.
    pub error_rate: f64,
    /// What they amount to.
    #[serde(flatten)]
    pub throughput: Throughput,
}

/// Means over sequences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The resistance; absent for all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resistance: Option<String>,
    /// Number of sequences.
    pub sequence_count: usize,
    /// Number of subjects.
    pub subject_count: usize,
    /// Throughput, bit/s.
    pub throughput_bit_per_s: f64,
    /// Its 95 % interval, with the subjects as what is independent; absent for one subject.
    pub throughput_interval_bit_per_s: Option<[f64; 2]>,
    /// Effective amplitude, m.
    pub effective_amplitude_m: f64,
    /// Effective width, m.
    pub effective_width_m: f64,
    /// Effective index of difficulty, bit.
    pub effective_id_bit: f64,
    /// Movement time, s.
    pub movement_time_s: f64,
    /// Error rate, a share.
    pub error_rate: f64,
}

/// The sequences that have a throughput; the others are refused by name.
pub(super) fn sequences(segments: &[Segment<'_>], task: Task, refused: &mut Vec<Refusal>) -> Vec<Sequence> {
    let mut sequences = Vec::new();
    for segment in segments {
        match sequence(segment, task) {
            Ok(sequence) => sequences.push(sequence),
            Err(error) => refused.push(Refusal {
                what: format!("throughput of {}", segment.name()),
                why: error.into(),
            }),
        }
    }
    sequences
}

fn sequence(segment: &Segment<'_>, task: Task) -> Result<Sequence, haptic_lab::stats::StatsError> {
    let movements: Vec<Movement> = segment
        .trials
        .iter()
        .map(|trial| Movement {
            amplitude_m: trial.amplitude_m,
            end_error_m: trial.end_error_m,
            movement_time_s: trial.movement_time_s,
        })
        .collect();
    let throughput = throughput(&movements, task)?;
    let is_error = |trial: &FittsTrial| trial.errors > 0 || trial.end_error_m.abs() > 0.5 * trial.width_m;
    let errors = segment.trials.iter().map(|trial| f64::from(u8::from(is_error(trial))));
    let errors: Vec<f64> = errors.collect();
    Ok(Sequence {
        subject: segment.subject.to_owned(),
        block: segment.block,
        resistance: segment.resistance.to_owned(),
        condition: segment.condition.to_owned(),
        trials: segment.trials.len(),
        error_rate: mean(&errors),
        throughput,
    })
}

impl Summary {
    /// The means over sequences; `None` if there are none.
    pub(super) fn of(resistance: Option<&str>, sequences: &[&Sequence]) -> Option<Self> {
        if sequences.is_empty() {
            return None;
        }
        let mean_of = |value: fn(&Sequence) -> f64| {
            let values: Vec<f64> = sequences.iter().map(|sequence| value(sequence)).collect();
            mean(&values)
        };
        let mut by_subject: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for sequence in sequences {
            let values = by_subject.entry(&sequence.subject).or_default();
            values.push(sequence.throughput.throughput_bit_per_s);
        }
        let clusters: Vec<Vec<f64>> = by_subject.into_values().collect();
        let throughput = clustered_mean(&clusters);
        Some(Self {
            resistance: resistance.map(str::to_owned),
            sequence_count: sequences.len(),
            subject_count: clusters.len(),
            throughput_bit_per_s: throughput.value,
            throughput_interval_bit_per_s: throughput.interval,
            effective_amplitude_m: mean_of(|one| one.throughput.effective_amplitude_m),
            effective_width_m: mean_of(|one| one.throughput.effective_width_m),
            effective_id_bit: mean_of(|one| one.throughput.effective_id_bit),
            movement_time_s: mean_of(|one| one.throughput.movement_time_s),
            error_rate: mean_of(|one| one.error_rate),
        })
    }
}

/// The means of each resistance that has a sequence.
pub(super) fn by_resistance(sequences: &[Sequence], resistances: &[String]) -> Vec<Summary> {
    let of = |name: &String| {
        let own: Vec<&Sequence> = sequences.iter().filter(|one| one.resistance == *name).collect();
        Summary::of(Some(name), &own)
    };
    resistances.iter().filter_map(of).collect()
}
