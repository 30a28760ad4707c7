//! What the subject's screen shows. Nothing here shows what is rendered, nor how a trial is named.

use super::super::fitts::Targets;
use super::super::perception;
use super::task::Task;

/// What the subject's screen shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the subject is.
    pub phase: Phase,
    /// Whether it is practice.
    pub is_practice: bool,
    /// Trials done, practice included.
    pub done: usize,
    /// Trials in all, practice included, or the most that there can be; none where a staircase has no such limit.
    pub of: Option<usize>,
    /// What came of the last click or answer, for a moment.
    pub feedback: Option<Feedback>,
}

/// Where the subject is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// Read what comes; continues by `proceed`.
    Instruction(Instruction),
    /// The experimenter changes the handle; continues by `proceed`.
    Mounting,
    /// A break, which may be ended by `proceed` at any time.
    Rest {
        /// What is left of it in whole seconds, rounded up: a screen need not be drawn again for less. 0 where it is
        /// over.
        remaining_s: u32,
    },
    /// Hold the handle, and wait: the scene changes, or no force flows yet.
    GetReady,
    /// Click on the active target.
    Targets(Targets),
    /// Wait: the surface changes.
    Wait,
    /// Feel the first (1) or the second (2) surface.
    Feel(u8),
    /// Which had more friction: the first (1, left arrow) or the second (2, right arrow)?
    Question,
    /// Paused, or broken off; continues by `proceed`, which is the experimenter's.
    Paused,
    /// All is done: thanks.
    Done,
}

impl Phase {
    /// Where a subject is whose task runs.
    pub(super) fn of(task: &Task) -> Self {
        match task {
            Task::Fitts(task) => task.targets().map_or(Self::GetReady, Self::Targets),
            Task::Perception(task) => match task.phase() {
                perception::Phase::Ready | perception::Phase::Finished => Self::GetReady,
                perception::Phase::Gap(_) => Self::Wait,
                perception::Phase::Feel(interval) => Self::Feel(interval),
                perception::Phase::Question => Self::Question,
            },
        }
    }
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    /// The task is explained, and practised.
    Practice,
    /// The trials that count.
    Trials,
}

/// What came of a click or an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedback {
    /// The cursor was wholly inside.
    Hit,
    /// The cursor was not wholly inside.
    Missed,
    /// The answer was taken. Whether it was right is shown in practice alone.
    Answered,
    /// The answer was right.
    Right,
    /// The answer was wrong.
    Wrong,
}
