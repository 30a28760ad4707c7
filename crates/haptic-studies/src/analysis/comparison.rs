//! The paper's Tables 3 to 5: how many subjects did better and worse than with the baseline, by index of difficulty and
//! resistance.

use super::error::Refusal;
use super::segments::Segment;
use haptic_lab::stats::exact::sign_test;
use serde::Serialize;
use std::collections::BTreeMap;

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Time that a segment took, s (Table 3).
    Time,
    /// Invalid clicks of a segment (Table 4).
    Errors,
    /// Their mean size, m (Table 5).
    ErrorSize,
}

impl Measure {
    /// All of them, in the order of the paper's tables.
    pub const ALL: [Self; 3] = [Self::Time, Self::Errors, Self::ErrorSize];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Errors => "errors",
            Self::ErrorSize => "error_size",
        }
    }

    /// The number of its table in the paper.
    pub(super) const fn table(self) -> u8 {
        3 + self as u8
    }

    fn of(self, difference: &Difference) -> Option<f64> {
        match self {
            Self::Time => Some(difference.time_s),
            Self::Errors => Some(difference.errors),
            Self::ErrorSize => difference.error_size_m,
        }
    }
}

/// By how much a segment must differ from the baseline to count as better or worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Of the time, s.
    pub time_s: f64,
    /// Of the errors.
    pub errors: f64,
    /// Of their mean size, m.
    pub error_size_m: f64,
}

impl Thresholds {
    /// Those of Richard and Cutkosky (2000).
    pub const PAPER: Self = Self {
        time_s: 0.5,
        errors: 1.0,
        error_size_m: 0.001,
    };

    /// That of a measure, in its unit.
    #[must_use]
    pub const fn of(&self, measure: Measure) -> f64 {
        match measure {
            Measure::Time => self.time_s,
            Measure::Errors => self.errors,
            Measure::ErrorSize => self.error_size_m,
        }
    }
}

/// A subject's segment under a resistance, less the one under the baseline in the same condition. Negative is better.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Code of the subject.
    pub subject: String,
    /// Name of the resistance.
    pub resistance: String,
    /// Name of the condition.
    pub condition: String,
    /// The condition's index of difficulty, bit.
    pub difficulty_bit: f64,
    /// Time of the segment, s.
    pub time_s: f64,
    /// Errors.
    pub errors: f64,
    /// Mean size of the errors, m; absent where the rows have no sizes.
    pub error_size_m: Option<f64>,
}

/// How many did better and worse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Better by the threshold or more.
    pub better: u64,
    /// Worse by the threshold or more.
    pub worse: u64,
    /// Neither.
    pub same: u64,
    /// Sign test of better against worse.
    pub sign_test_p: f64,
}

impl Counts {
    fn of(differences: impl Iterator<Item = f64>, threshold: f64) -> Self {
        let mut counts = Self::default();
        for difference in differences {
            match direction(difference, threshold) {
                -1 => counts.better += 1,
                1 => counts.worse += 1,
                _ => counts.same += 1,
            }
        }
        counts.sign_test_p = sign_test(counts.better, counts.worse);
        counts
    }
}

/// -1 where a difference is better by the threshold or more, 1 where it is worse, else 0.
fn direction(difference: f64, threshold: f64) -> i64 {
    /// A difference of exactly the threshold counts, though rounding may have taken some of its last digits.
    const ROUNDING: f64 = 1e-9;
    let limit = threshold * (1.0 - ROUNDING);
    i64::from(difference >= limit) - i64::from(difference <= -limit)
}

/// The row of a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparisonRow {
    /// Name of the condition.
    pub condition: String,
    /// Its index of difficulty, bit.
    pub difficulty_bit: f64,
    /// Counts of the subjects, by resistance.
    pub counts: Vec<Counts>,
}

/// The sums of a resistance over all conditions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Total {
    /// Better, over subjects and conditions.
    pub better: u64,
    /// Worse.
    pub worse: u64,
    /// Neither.
    pub same: u64,
    /// Subjects with more conditions better than worse.
    pub subjects_better: u64,
    /// Subjects with more conditions worse than better.
    pub subjects_worse: u64,
    /// Sign test of these subjects: the conditions of one subject are not independent, the subjects are.
    pub sign_test_p: f64,
}

/// Two resistances against one another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// One resistance.
    pub first: String,
    /// The other.
    pub second: String,
    /// Subjects for whom the first did better: better less worse over the conditions that have both.
    pub subjects_first: u64,
    /// Subjects for whom the second did better.
    pub subjects_second: u64,
    /// Sign test of these subjects.
    pub sign_test_p: f64,
}

/// One of the three tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What is compared.
    pub measure: Measure,
    /// Difference that counts, s, errors or m.
    pub threshold: f64,
    /// The resistances, in the order of the counts.
    pub resistances: Vec<String>,
    /// A row for each condition, the easiest first.
    pub rows: Vec<ComparisonRow>,
    /// The sums, by resistance.
    pub totals: Vec<Total>,
    /// Every two resistances.
    pub pairs: Vec<Pair>,
}

/// All differences from the baseline. Where a subject has more than one segment of a resistance in a condition, the
/// last block counts: the paper's subjects began with a round of the baseline, and were less used to the task then.
pub(super) fn differences(segments: &[Segment<'_>], baseline: &str, refused: &mut Vec<Refusal>) -> Vec<Difference> {
    let last: BTreeMap<_, &Segment<'_>> = segments
        .iter()
        .map(|segment| ((segment.subject, segment.condition, segment.resistance), segment))
        .collect();
    let mut differences = Vec::new();
    for ((subject, condition, resistance), segment) in &last {
        let Some(baseline) = last
            .get(&(*subject, *condition, baseline))
            .filter(|_| *resistance != baseline)
        else {
            continue;
        };
        let (trials, expected) = (segment.trials.len(), baseline.trials.len());
        if trials != expected {
            refused.push(Refusal {
                what: format!("comparison of {}", segment.name()),
                why: format!(
                    "it has {trials} trials, and the baseline (block {}) has {expected}",
                    baseline.block
                )
                .into(),
            });
            continue;
        }
        let sizes_m = segment.mean_error_size_m().zip(baseline.mean_error_size_m());
        differences.push(Difference {
            subject: (*subject).to_owned(),
            resistance: (*resistance).to_owned(),
            condition: (*condition).to_owned(),
            difficulty_bit: segment.difficulty_bit(),
            time_s: segment.completion_time_s() - baseline.completion_time_s(),
            errors: f64::from(segment.errors()) - f64::from(baseline.errors()),
            error_size_m: sizes_m.map(|(own, base)| own - base),
        });
    }
    differences
}

/// The tables of those measures that the rows have.
pub(super) fn comparisons(
    differences: &[Difference],
    resistances: &[String],
    thresholds: &Thresholds,
) -> Vec<Comparison> {
    let compared: Vec<String> = resistances
        .iter()
        .filter(|name| differences.iter().any(|one| one.resistance == **name))
        .cloned()
        .collect();
    let mut conditions: Vec<(&str, f64)> = differences
        .iter()
        .map(|one| (one.condition.as_str(), one.difficulty_bit))
        .collect();
    conditions.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| a.0.cmp(b.0)));
    conditions.dedup();
    let table = |measure: Measure| {
        let threshold = thresholds.of(measure);
        let rows: Vec<ComparisonRow> = conditions
            .iter()
            .map(|(condition, difficulty_bit)| {
                let counts = |name: &String| {
                    let own = differences
                        .iter()
                        .filter(|one| one.resistance == *name && one.condition == *condition);
                    Counts::of(own.filter_map(|one| measure.of(one)), threshold)
                };
                ComparisonRow {
                    condition: (*condition).to_owned(),
                    difficulty_bit: *difficulty_bit,
                    counts: compared.iter().map(counts).collect(),
                }
            })
            .collect();
        let net: Vec<BTreeMap<&str, BTreeMap<&str, i64>>> = compared
            .iter()
            .map(|name| directions(differences, name, measure, threshold))
            .collect();
        Comparison {
            measure,
            threshold,
            totals: (0..compared.len())
                .map(|place| total(&rows, place, &net[place]))
                .collect(),
            pairs: pairs(&compared, &net),
            rows,
            resistances: compared.clone(),
        }
    };
    Measure::ALL
        .into_iter()
        .filter(|measure| differences.iter().any(|one| measure.of(one).is_some()))
        .map(table)
        .collect()
}

/// The directions of a resistance, by subject and condition.
fn directions<'a>(
    differences: &'a [Difference],
    resistance: &str,
    measure: Measure,
    threshold: f64,
) -> BTreeMap<&'a str, BTreeMap<&'a str, i64>> {
    let mut by_subject: BTreeMap<&str, BTreeMap<&str, i64>> = BTreeMap::new();
    for one in differences.iter().filter(|one| one.resistance == resistance) {
        if let Some(difference) = measure.of(one) {
            let conditions = by_subject.entry(&one.subject).or_default();
            conditions.insert(&one.condition, direction(difference, threshold));
        }
    }
    by_subject
}

fn total(rows: &[ComparisonRow], place: usize, directions: &BTreeMap<&str, BTreeMap<&str, i64>>) -> Total {
    let sum = |of: fn(&Counts) -> u64| rows.iter().map(|row| of(&row.counts[place])).sum();
    let (better, worse) = majorities(directions.values().map(|conditions| conditions.values().sum()));
    Total {
        better: sum(|counts| counts.better),
        worse: sum(|counts| counts.worse),
        same: sum(|counts| counts.same),
        subjects_better: better,
        subjects_worse: worse,
        sign_test_p: sign_test(better, worse),
    }
}

/// How many sums are below zero, and how many above.
fn majorities(sums: impl Iterator<Item = i64>) -> (u64, u64) {
    sums.fold((0, 0), |(below, above), sum| {
        (below + u64::from(sum < 0), above + u64::from(sum > 0))
    })
}

fn pairs(resistances: &[String], net: &[BTreeMap<&str, BTreeMap<&str, i64>>]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (first, name) in resistances.iter().enumerate() {
        for (second, other) in resistances.iter().enumerate().skip(first + 1) {
            let sums = net[first].iter().filter_map(|(subject, own)| {
                let others = net[second].get(subject)?;
                let both = own
                    .iter()
                    .filter_map(|(condition, direction)| Some(direction - others.get(condition)?));
                Some(both.sum())
            });
            let (subjects_first, subjects_second) = majorities(sums);
            pairs.push(Pair {
                first: name.clone(),
                second: other.clone(),
                subjects_first,
                subjects_second,
                sign_test_p: sign_test(subjects_first, subjects_second),
            });
        }
    }
    pairs
}

/// Its name in the rows of a study whose plan is not known.
pub const BASELINE: &str = "baseline";
