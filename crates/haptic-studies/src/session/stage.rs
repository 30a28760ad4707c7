//! The stages of a session.

use super::interruption::Interruption;
use super::task::Task;
use super::view::Instruction;
use std::collections::VecDeque;

/// Where a session is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Stage {
    Instruction(Instruction),
    Mounting,
    /// Ticks that are left of a break.
    Rest(f64),
    GetReady,
    Running,
    Paused(Interruption),
    Done,
}

/// What comes before the next trial, after one of practice or not; at the beginning after none. Empty at the end.
pub(super) fn stages(task: &Task, is_mounted: bool, after: Option<bool>, period_s: f64) -> VecDeque<Stage> {
    let mut stages = VecDeque::new();
    if task.is_finished() {
        return stages;
    }
    let (is_practice, rest_s) = (task.is_practice(), task.rest_s());
    if after.is_some() && rest_s > 0.0 {
        stages.push_back(Stage::Rest(rest_s / period_s));
    }
    if after != Some(is_practice) {
        stages.push_back(Stage::Instruction(if is_practice {
            Instruction::Practice
        } else {
            Instruction::Trials
        }));
    }
    if task.mounted().is_some() != is_mounted {
        stages.push_back(Stage::Mounting);
    }
    stages.push_back(Stage::GetReady);
    stages
}
