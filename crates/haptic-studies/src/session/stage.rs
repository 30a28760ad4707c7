//! The stages of a session, and why it was interrupted.

use super::task::Task;
use super::view::Instruction;
use haptic_ipc::RigState;
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

/// Why a session was interrupted. A trial under way is void, and done again.
#[derive(Clone, Debug, PartialEq)]
pub enum Interruption {
    /// A person paused it.
    Paused,
    /// The rig's force does not flow; with the fault, where it is known.
    State(RigState, Option<String>),
    /// Ticks are missing.
    LostTicks(u64),
    /// The daemon was started again, or the connection to it re-established.
    NewLink,
    /// Another program changed the scene.
    SceneChanged {
        /// The revision that is rendered.
        revision: u64,
    },
    /// The scene could not be set.
    SceneRefused(String),
    /// A trial took longer than a recording may be.
    TooLong {
        /// Longest time, s.
        limit_s: f64,
    },
}

impl std::fmt::Display for Interruption {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Paused => write!(formatter, "paused"),
            Self::State(state, None) => write!(formatter, "the rig is {state}"),
            Self::State(state, Some(fault)) => write!(formatter, "the rig is {state}: {fault}"),
            Self::LostTicks(ticks) => write!(formatter, "{ticks} ticks are missing"),
            Self::NewLink => write!(formatter, "the connection to the daemon was re-established"),
            Self::SceneChanged { revision } => {
                write!(formatter, "another program changed the scene: revision {revision}")
            }
            Self::SceneRefused(why) => write!(formatter, "the scene could not be set: {why}"),
            Self::TooLong { limit_s } => write!(formatter, "the trial took longer than {limit_s} s"),
        }
    }
}
