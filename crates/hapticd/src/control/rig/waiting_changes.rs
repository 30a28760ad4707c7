//! The scheduled changes that wait for their tick.

use crate::control::compile::RampPath;
use crate::control::history::Move;
use crate::rt::claim::{Claim, ClaimState};
use haptic_core::Scene;
use haptic_ipc::{JournalEntry, Peer, SceneRamp};
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

/// A scheduled change that the loop has not rendered, as far as is known here.
#[derive(Debug)]
pub(super) struct WaitingChange {
    pub(super) at_tick: u64,
    /// The first tick after it and its ramp.
    pub(super) over_tick: u64,
    pub(super) revision: u64,
    pub(super) scene: Rc<Scene>,
    pub(super) ramp: Option<SceneRamp>,
    pub(super) path: Option<RampPath>,
    pub(super) step: Move,
    pub(super) entry: JournalEntry,
    /// Compiled scenes that it holds.
    pub(super) compiled: usize,
    pub(super) claim: Arc<Claim>,
}

impl WaitingChange {
    /// The name of its schedule.
    pub(super) fn name(&self) -> Option<&str> {
        self.entry.schedule.as_deref()
    }
}

/// The changes that wait.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    /// Changes that were sent to the loop so far.
    pub(super) sent: usize,
    pub(super) waiting: VecDeque<WaitingChange>,
    /// The client whose changes wait.
    pub(super) session: u64,
    pub(super) by: Peer,
    /// Whether they stay when that client ends.
    pub(super) keep: bool,
}

impl Schedule {
    /// Takes back the changes from one on, and removes them; the loop may have rendered some of them by now.
    pub(super) fn withdraw(&mut self, first: usize) -> usize {
        let mut cancelled = 0;
        // The last one first: none is rendered whose predecessor was taken back.
        while self.waiting.len() > first
            && self
                .waiting
                .back()
                .is_some_and(|last| last.claim.decide(ClaimState::Withdrawn))
        {
            self.waiting.pop_back();
            cancelled += 1;
        }
        cancelled
    }
}
