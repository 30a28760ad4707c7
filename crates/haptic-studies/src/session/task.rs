//! The two tasks behind one face.

use super::super::fitts::{self, FittsSession};
use super::super::perception::{self, PerceptionSession};
use super::super::plan::Plan;
use super::super::subject::Subject;
use super::super::trial::Operator;
use haptic_core::Scene;

/// The task of a session.
#[derive(Debug)]
pub enum Task {
    /// Targets to be clicked.
    Fitts(FittsSession),
    /// Surfaces to distinguish.
    Perception(PerceptionSession),
}

impl Task {
    /// The task of a plan, which nobody has begun. A tick takes `period_s`, s.
    #[must_use]
    pub fn new(plan: &Plan, seed: u64, subject: &Subject, operator: Operator, period_s: f64) -> Self {
        match plan {
            Plan::Fitts(plan) => Self::Fitts(FittsSession::new(plan, seed, subject, operator, period_s)),
            Plan::Perception(plan) => Self::Perception(PerceptionSession::new(plan, seed, subject, operator, period_s)),
        }
    }

    pub(in super::super) fn is_finished(&self) -> bool {
        match self {
            Self::Fitts(task) => task.segment().is_none(),
            Self::Perception(task) => task.upcoming().is_none(),
        }
    }

    /// Whether a trial is under way: an attempt that can be voided.
    pub(super) fn is_in_trial(&self) -> bool {
        match self {
            Self::Fitts(task) => task.phase() == fitts::Phase::Trial,
            Self::Perception(task) => !matches!(task.phase(), perception::Phase::Ready | perception::Phase::Finished),
        }
    }

    /// Whether it waits for [`begin`](Self::begin).
    pub(super) fn is_ready(&self) -> bool {
        match self {
            Self::Fitts(task) => task.phase() == fitts::Phase::Ready,
            Self::Perception(task) => task.phase() == perception::Phase::Ready,
        }
    }

    /// Whether the surface of the next interval may still be on its way to the rig.
    pub(super) fn is_between_surfaces(&self) -> bool {
        matches!(self, Self::Perception(task) if matches!(task.phase(), perception::Phase::Gap(_)))
    }

    /// Whether the trial that is done now, or next, is for practice.
    #[must_use]
    pub fn is_practice(&self) -> bool {
        match self {
            Self::Fitts(task) => task.segment().is_some_and(|segment| segment.is_practice),
            Self::Perception(task) => task.upcoming().is_some_and(|upcoming| upcoming.is_practice),
        }
    }

    /// What the rig is to render.
    pub(super) fn scene(&self) -> Option<Scene> {
        match self {
            Self::Fitts(task) => task.segment().map(|segment| segment.resistance.rendered()),
            Self::Perception(task) => task.surface(),
        }
    }

    /// The resistance that a person mounts on the handle.
    pub(super) fn mounted(&self) -> Option<&str> {
        let Self::Fitts(task) = self else { return None };
        let resistance = &task.segment()?.resistance;
        resistance.mounted.is_some().then_some(resistance.name.as_str())
    }

    /// Length of the break before what comes next, s; 0 where there is none.
    pub(super) fn rest_s(&self) -> f64 {
        match self {
            Self::Fitts(task) => task.rest_s(),
            Self::Perception(task) => task.rest_s(),
        }
    }

    /// Trials done, and trials in all or the most that there can be, practice included.
    pub(in super::super) fn progress(&self) -> (usize, Option<usize>) {
        match self {
            Self::Fitts(task) => {
                let (done, all) = task.progress();
                (done, Some(all))
            }
            Self::Perception(task) => task.progress(),
        }
    }

    /// Rows done of practice, or of the others.
    pub(in super::super) fn rows(&self, is_practice: bool) -> u32 {
        let (practice, trials) = match self {
            Self::Fitts(task) => task.rows(),
            Self::Perception(task) => task.rows(),
        };
        if is_practice { practice } else { trials }
    }

    pub(super) fn begin(&mut self, tick: u64) {
        match self {
            Self::Fitts(task) => task.begin(),
            Self::Perception(task) => task.begin(tick),
        }
    }

    pub(super) fn pause(&mut self) {
        match self {
            Self::Fitts(task) => task.pause(),
            Self::Perception(task) => task.pause(),
        }
    }
}
