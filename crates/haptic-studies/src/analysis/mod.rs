//! What the trials of a study say: the paper's tables and figures, and the throughput of ISO 9241-411.
//!
//! Everything is computed from the rows alone, in an order of its own: a file with its rows in another order gives the
//! same to the last bit.

mod comparison;
mod data;
mod difficulty;
mod error;
mod outputs;
mod page;
mod paper;
mod perception;
mod segments;
mod sequences;
mod tables;
mod trajectories;

pub use super::store::{Trials, read_file, read_folder};
pub use comparison::{BASELINE, Comparison, ComparisonRow, Counts, Difference, Measure, Pair, Thresholds, Total};
pub use data::{fitts_data, perception_data};
pub use difficulty::{DifficultyLine, Point};
pub use error::{AnalysisError, Reason, Refusal};
pub use outputs::{fitts_files, perception_files};
pub use paper::BesidePaper;
pub use perception::{CaseAnalysis, PerceptionAnalysis, SubjectThreshold, perception};
pub use sequences::{Sequence, Summary};
pub use tables::{PAGE, TERMINAL, fitts_tables, perception_tables};
pub use trajectories::{Trajectory, trajectories};

use super::plan::FittsPlan;
use super::screen::ScreenSummary;
use super::trial::{FittsTrial, Operator};
use haptic_lab::stats::throughput::Task;
use serde::Serialize;

/// What the trials of a targeting task say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittsAnalysis {
    /// Whether people or a model did the trials, where the rows say so.
    pub operator: Option<Operator>,
    /// Number of trials.
    pub trials: usize,
    /// ISO 9241-411 over all sequences; absent where no sequence has a throughput.
    #[serde(flatten)]
    pub overall: Option<Summary>,
    /// ISO 9241-411 by resistance.
    pub by_resistance: Vec<Summary>,
    /// ISO 9241-411 by sequence: subject, block, resistance and condition.
    pub sequences: Vec<Sequence>,
    /// The paper's Tables 3 to 5: time, errors, and size of the errors.
    pub comparisons: Vec<Comparison>,
    /// What those are counted from, a subject, resistance and condition each.
    pub differences: Vec<Difference>,
    /// Which blocks are pooled, where the baseline stands in several: a footnote of tables, and a note too.
    #[serde(skip)]
    pub pooled_baseline: Option<String>,
    /// The totals of time beside those that the paper's authors have shown, where the study is as theirs.
    pub beside_paper: Vec<BesidePaper>,
    /// Movement time against the paper's index of difficulty, by resistance.
    pub difficulty: Vec<DifficultyLine>,
    /// How late, and how often, the subjects' screen showed the cursor; absent where no row has it.
    pub screen: Option<ScreenSummary>,
    /// What the trials do not show.
    pub refused: Vec<Refusal>,
    /// Remarks for people.
    pub notes: Vec<String>,
}

impl FittsAnalysis {
    /// Puts the paper's values beside those of a study by this plan, where they compare.
    pub fn put_beside_paper(&mut self, plan: &FittsPlan) {
        self.beside_paper = paper::beside(&self.comparisons, plan);
    }
}

/// Analyses the trials of a targeting task, in any order. The others are compared with the resistance `baseline`.
///
/// # Errors
/// There are no trials, two are the same one, or a sequence has more than one target.
pub fn fitts(
    trials: &[FittsTrial],
    baseline: &str,
    thresholds: &Thresholds,
    task: Task,
) -> Result<FittsAnalysis, AnalysisError> {
    let segments = segments::segments(trials)?;
    let resistances = segments::resistances(&segments, baseline);
    let (mut refused, mut notes) = (Vec::new(), Vec::new());
    let sequences = sequences::sequences(&segments, task, &mut refused);
    let differences = comparison::differences(&segments, baseline, &mut refused);
    let comparisons = comparison::comparisons(&differences, &resistances, thresholds);
    if task == Task::Discrete {
        notes.push("a discrete task: each movement begins at the centre of a place of its own".to_owned());
    }
    if trials.iter().any(|trial| trial.cursor_diameter_m.is_none()) {
        notes.push("rows without cursor_diameter_m: the index of difficulty takes the cursor as a point".to_owned());
    }
    let pooled_baseline = segments::pooled(&segments, baseline);
    notes.extend(pooled_baseline.clone());
    if differences.is_empty() {
        let mut reason =
            format!("no subject has a segment of `{baseline}` and one of another resistance in one condition");
        if baseline == BASELINE {
            reason.push_str("; in a file the baseline has that name, in the folder of a study the plan's");
        }
        refused.push(Refusal {
            what: "comparison with the baseline".to_owned(),
            why: reason.into(),
        });
    }
    let operator = trials[0].operator;
    if trials.iter().any(|trial| trial.operator != operator) {
        return Err(AnalysisError::mixed_operators());
    }
    if operator == Some(Operator::Simulated) {
        notes.push("a model did these trials: they say nothing about people".to_owned());
    }
    let voided: u32 = trials.iter().map(|trial| trial.voided).sum();
    if voided > 0 {
        notes.push(format!("void attempts at trials, which were done again: {voided}"));
    }
    let screen = ScreenSummary::of(trials);
    notes.extend(screen.map(|screen| screen.to_string()));
    Ok(FittsAnalysis {
        operator,
        trials: trials.len(),
        overall: Summary::of(None, &sequences.iter().collect::<Vec<_>>()),
        by_resistance: sequences::by_resistance(&sequences, &resistances),
        beside_paper: Vec::new(),
        difficulty: difficulty::by_resistance(&segments, &resistances, &mut refused),
        sequences,
        comparisons,
        differences,
        pooled_baseline,
        screen,
        refused,
        notes,
    })
}

#[cfg(test)]
mod tests;
