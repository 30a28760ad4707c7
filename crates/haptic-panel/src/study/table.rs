//! The trials of a subject as the experimenter's table has them, and what is done now.

use super::news::StudyRow;
use haptic_studies::person::PersonSession;
use haptic_studies::plan::Task;
use haptic_studies::session::{self, Phase, TrialRow};
use haptic_studies::store::{self, StoreError};
use haptic_studies::subject::Subject;
use haptic_studies::trial::{FittsTrial, PerceptionTrial, VoidedTrial};
use std::path::Path;

pub(super) const fn columns(task: Task) -> &'static [&'static str] {
    match task {
        Task::Fitts => &[
            "Block",
            "Trial",
            "Resistance",
            "Condition",
            "End error (mm)",
            "Time (s)",
            "Errors",
            "Latency (ms)",
        ],
        Task::Perception => &[
            "Case",
            "Trial",
            "Level (N)",
            "Comparison",
            "Answer",
            "Correct",
            "Time (s)",
            "Reversal",
        ],
    }
}

/// The row of a trial that is on the disk.
pub(super) fn row(row: &TrialRow) -> StudyRow {
    let cells = match row {
        TrialRow::Fitts(trial) => fitts_cells(trial),
        TrialRow::Perception(trial) => perception_cells(trial),
    };
    StudyRow { cells, void: None }
}

/// The row of an attempt that does not count.
pub(super) fn void(voided: &VoidedTrial) -> StudyRow {
    StudyRow {
        cells: Vec::new(),
        void: Some(voided.reason.clone()),
    }
}

fn fitts_cells(trial: &FittsTrial) -> Vec<String> {
    vec![
        trial.block.to_string(),
        trial.trial.to_string(),
        trial.resistance.clone(),
        trial.condition.clone(),
        format!("{:.1}", trial.end_error_m * 1e3),
        format!("{:.3}", trial.movement_time_s),
        trial.errors.to_string(),
        trial
            .cursor_latency_s
            .map_or_else(String::new, |latency_s| format!("{:.1}", latency_s * 1e3)),
    ]
}

fn perception_cells(trial: &PerceptionTrial) -> Vec<String> {
    let place = |is_first: bool| if is_first { "first" } else { "second" };
    let yes = |is_so: bool| if is_so { "yes" } else { "no" };
    vec![
        format!("{:?}", trial.case),
        trial.trial.to_string(),
        format!("{:.2}", trial.level_n),
        place(trial.comparison_first).to_owned(),
        place(trial.answer == 1).to_owned(),
        yes(trial.correct).to_owned(),
        trial
            .response_time_s
            .map_or_else(String::new, |time_s| format!("{time_s:.2}")),
        if trial.reversal { "yes" } else { "" }.to_owned(),
    ]
}

/// The rows of a subject that are on the disk, without practice.
pub(super) fn rows(folder: &Path, task: Task, subject: &Subject) -> Result<Vec<StudyRow>, StoreError> {
    let all_cells: Vec<Vec<String>> = match task {
        Task::Fitts => {
            let trials = store::trials_of(folder, subject, task, false)?;
            trials.iter().map(fitts_cells).collect()
        }
        Task::Perception => {
            let trials = store::trials_of(folder, subject, task, false)?;
            trials.iter().map(perception_cells).collect()
        }
    };
    let rows = all_cells.into_iter().map(|cells| StudyRow { cells, void: None });
    Ok(rows.collect())
}

/// What is done now or next, as names and values.
pub(super) fn now(task: &session::Task) -> Vec<(&'static str, String)> {
    let kind = |is_practice: bool| if is_practice { "practice" } else { "counts" }.to_owned();
    match task {
        session::Task::Fitts(task) => {
            let Some(segment) = task.segment() else {
                return Vec::new();
            };
            let condition = &segment.condition;
            let (width_mm, amplitude_mm) = (condition.width_m * 1e3, condition.amplitude_m * 1e3);
            vec![
                ("Segment", format!("{}, {}", segment.block, kind(segment.is_practice))),
                ("Resistance", segment.resistance.name.clone()),
                (
                    "Condition",
                    format!("{}: {amplitude_mm:.0} mm, width {width_mm:.0} mm", condition.name),
                ),
                ("Trial", (task.place().1 + 1).to_string()),
            ]
        }
        session::Task::Perception(task) => {
            let Some(upcoming) = task.upcoming() else {
                return Vec::new();
            };
            let place = if upcoming.comparison_first { "first" } else { "second" };
            vec![
                ("Case", format!("{:?}", upcoming.case)),
                ("Trial", format!("{}, {}", upcoming.trial, kind(upcoming.is_practice))),
                ("Level", format!("{:.2} N", upcoming.level_n)),
                ("Comparison", place.to_owned()),
            ]
        }
    }
}

/// Edges of the active target on the axis of the handle, m.
pub(super) fn target_m(session: &PersonSession) -> Option<[f64; 2]> {
    let (session::Task::Fitts(task), Phase::Targets(targets)) = (session.task(), session.view().phase) else {
        return None;
    };
    let mapping = task.mapping();
    let half_m = 0.5 * targets.width_m;
    Some([targets.active_m - half_m, targets.active_m + half_m].map(|edge_m| mapping.rig_m(edge_m)))
}
