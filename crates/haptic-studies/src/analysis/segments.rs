//! Trials by segment: the movements of a subject under one resistance in one condition, one after another.

use super::error::AnalysisError;
use super::paper;
use crate::trial::FittsTrial;
use haptic_lab::stats::throughput::index_of_difficulty;
use std::collections::BTreeMap;

/// A segment; its trials by their numbers.
#[derive(Clone, Debug)]
pub(super) struct Segment<'a> {
    pub(super) subject: &'a str,
    pub(super) block: u32,
    pub(super) resistance: &'a str,
    pub(super) condition: &'a str,
    pub(super) trials: Vec<&'a FittsTrial>,
}

impl Segment<'_> {
    /// What it is called in messages.
    pub(super) fn name(&self) -> String {
        let Self {
            subject,
            block,
            resistance,
            condition,
            ..
        } = self;
        format!("subject {subject}, block {block}, resistance {resistance}, condition {condition}")
    }

    /// The paper's index of difficulty, bit. Without a cursor in the rows it is a point.
    pub(super) fn difficulty_bit(&self) -> f64 {
        let first = self.trials[0];
        // The rows were checked when they were read.
        index_of_difficulty(first.amplitude_m, first.width_m, first.cursor_diameter_m.unwrap_or(0.0))
            .unwrap_or(f64::NAN)
    }

    /// Sum of the movement times, s.
    pub(super) fn completion_time_s(&self) -> f64 {
        self.trials.iter().map(|trial| trial.movement_time_s).sum()
    }

    /// Number of invalid clicks.
    pub(super) fn errors(&self) -> u32 {
        self.trials.iter().map(|trial| trial.errors).sum()
    }

    /// Mean size of the invalid clicks, m: 0 without one, `None` where the rows have no sizes.
    pub(super) fn mean_error_size_m(&self) -> Option<f64> {
        let sizes: Option<Vec<f64>> = self
            .trials
            .iter()
            .map(|trial| trial.error_size_m.or((trial.errors == 0).then_some(0.0)))
            .collect();
        let sum: f64 = sizes?.iter().sum();
        Some(match self.errors() {
            0 => 0.0,
            errors => sum / f64::from(errors),
        })
    }

    fn lengths_m(&self) -> [(&'static str, f64); 3] {
        lengths_m(self.trials[0])
    }
}

fn lengths_m(trial: &FittsTrial) -> [(&'static str, f64); 3] {
    [
        ("amplitude_m", trial.amplitude_m),
        ("width_m", trial.width_m),
        ("cursor_diameter_m", trial.cursor_diameter_m.unwrap_or(0.0)),
    ]
}

/// The first length that differs: its column, and both values.
fn first_difference(
    found: [(&'static str, f64); 3],
    expected: [(&'static str, f64); 3],
) -> Option<(&'static str, f64, f64)> {
    found
        .into_iter()
        .zip(expected)
        .find(|(found, expected)| found.1 != expected.1)
        .map(|((column, found), (_, expected))| (column, found, expected))
}

/// The segments, by subject, block, resistance and condition.
pub(super) fn segments(trials: &[FittsTrial]) -> Result<Vec<Segment<'_>>, AnalysisError> {
    if trials.is_empty() {
        return Err(AnalysisError::no_trials());
    }
    let mut by_key: BTreeMap<_, BTreeMap<u32, &FittsTrial>> = BTreeMap::new();
    for trial in trials {
        let key = (
            trial.subject.as_str(),
            trial.block,
            trial.resistance.as_str(),
            trial.condition.as_str(),
        );
        if by_key.entry(key).or_default().insert(trial.trial, trial).is_some() {
            let sequence = segment(key, BTreeMap::new()).name();
            return Err(AnalysisError::twice(trial.trial, &sequence));
        }
    }
    let segments: Vec<Segment<'_>> = by_key.into_iter().map(|(key, trials)| segment(key, trials)).collect();
    let mut targets = BTreeMap::new();
    for segment in &segments {
        for trial in &segment.trials {
            if let Some((column, value, expected)) = first_difference(lengths_m(trial), segment.lengths_m()) {
                return Err(AnalysisError(format!(
                    "trial {} of {} has {column} = {value} m, the trials before it {expected} m",
                    trial.trial,
                    segment.name()
                )));
            }
        }
        let elsewhere = *targets.entry(segment.condition).or_insert_with(|| segment.lengths_m());
        if let Some((column, value, expected)) = first_difference(segment.lengths_m(), elsewhere) {
            return Err(AnalysisError(format!(
                "condition `{}` has {column} = {value} m in {}, and {expected} m elsewhere",
                segment.condition,
                segment.name()
            )));
        }
    }
    Ok(segments)
}

fn segment<'a>(
    (subject, block, resistance, condition): (&'a str, u32, &'a str, &'a str),
    trials: BTreeMap<u32, &'a FittsTrial>,
) -> Segment<'a> {
    Segment {
        subject,
        block,
        resistance,
        condition,
        trials: trials.into_values().collect(),
    }
}

/// Says that the baseline of subjects stands in more than one of their blocks, if so: as practice of the task before all
/// others, and in its turn.
pub(super) fn pooled(segments: &[Segment<'_>], baseline: &str) -> Option<String> {
    let mut blocks: BTreeMap<_, usize> = BTreeMap::new();
    for segment in segments.iter().filter(|segment| segment.resistance == baseline) {
        *blocks.entry((segment.subject, segment.condition)).or_default() += 1;
    }
    let is_pooled = blocks.values().any(|blocks| *blocks > 1);
    is_pooled.then(|| {
        format!(
            "{baseline} is the baseline: throughput and difficulty pool its segments before all others, where the task \
             is new, with those in its turn; comparisons take the last of each condition"
        )
    })
}

/// The resistances: the baseline, then those of the paper in its order, then others by name.
pub(super) fn resistances(segments: &[Segment<'_>], baseline: &str) -> Vec<String> {
    let place = |name: &str| {
        if name == baseline { 0 } else { 1 + paper::place(name) }
    };
    let mut names: Vec<String> = segments.iter().map(|segment| segment.resistance.to_owned()).collect();
    names.sort_by(|a, b| place(a).cmp(&place(b)).then_with(|| a.cmp(b)));
    names.dedup();
    names
}
