//! The paper's figures, and a study's totals beside them.

use super::comparison::{Comparison, Measure};
use crate::plan::{FittsPlan, PerceptionPlan, Plan, Task};
use crate::trial::Case;
use haptic_lab::stats::exact::fisher;
use serde::Serialize;

/// A study's totals of time beside the paper's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BesidePaper {
    /// Name of the resistance.
    pub resistance: String,
    /// Better and worse in the paper.
    pub paper: [u64; 2],
    /// Better and worse in this study.
    pub study: [u64; 2],
    /// Fisher's exact test of the two rows. It takes all counts as independent, which those of one subject are not: it
    /// is smaller than the truth.
    pub fisher_p: f64,
}

/// The program's own plan, which is the paper's.
fn built_in(task: Task) -> Option<Plan> {
    Plan::read(task.built_in_plan()).ok()
}

/// The totals of those resistances that the paper has, where conditions, baseline and resistance are the paper's.
pub(super) fn beside(comparisons: &[Comparison], plan: &FittsPlan) -> Vec<BesidePaper> {
    let Some(Plan::Fitts(paper)) = built_in(Task::Fitts) else {
        return Vec::new();
    };
    let is_same_task = (&plan.baseline, &plan.conditions, &plan.cursor, plan.trials_per_segment)
        == (
            &paper.baseline,
            &paper.conditions,
            &paper.cursor,
            paper.trials_per_segment,
        );
    let resistance = |plan: &FittsPlan, name: &str| plan.resistances.iter().find(|one| one.name == name).cloned();
    let is_same = |name: &str| resistance(plan, name) == resistance(&paper, name);
    if !is_same_task || !is_same(&paper.baseline) {
        return Vec::new();
    }
    let Some(times) = comparisons.iter().find(|one| one.measure == Measure::Time) else {
        return Vec::new();
    };
    let of = |(name, paper): (&str, [u64; 2])| {
        if !is_same(name) {
            return None;
        }
        let place = times.resistances.iter().position(|resistance| resistance == name)?;
        let study = [times.totals[place].better, times.totals[place].worse];
        Some(BesidePaper {
            resistance: name.to_owned(),
            paper,
            study,
            fisher_p: fisher(paper, study),
        })
    };
    TIMES.into_iter().filter_map(of).collect()
}

/// Better and worse in time than the baseline: sums over 20 subjects and nine indices of difficulty, from the slides of
/// Richard and Cutkosky (2000).
pub(super) const TIMES: [(&str, [u64; 2]); 4] = [
    ("real", [74, 50]),
    ("simulated", [75, 43]),
    ("high stiction", [48, 88]),
    ("viscous", [80, 44]),
];

/// Whether a study's base is the paper's.
pub(super) fn has_base(plan: &PerceptionPlan) -> bool {
    matches!(built_in(Task::Perception), Some(Plan::Perception(paper)) if paper.base == plan.base)
}

/// Just noticeable difference that the paper gives for a case, N.
#[expect(clippy::approx_constant, reason = "3.14 N is a force")]
pub(super) const fn jnd_n(case: Case) -> f64 {
    match case {
        Case::A => 0.78,
        Case::B => 3.14,
        Case::C => 0.36,
    }
}

/// The place of a resistance in the paper's tables; the same for all that it does not have.
pub(super) fn place(resistance: &str) -> usize {
    TIMES
        .iter()
        .position(|(name, _)| *name == resistance)
        .unwrap_or(TIMES.len())
}
