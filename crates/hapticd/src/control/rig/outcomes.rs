//! What became of scheduled changes: those that were rendered go into the history, and all into the journal.

use super::waiting_changes::{Schedule, WaitingChange};
use super::{Ramp, RigHandle};
use crate::control::journal::Completion;
use crate::rt::claim::ClaimState;
use haptic_ipc::{JournalEntry, Peer};

impl RigHandle {
    /// Enters what has become of scheduled changes into the history and the journal.
    pub(super) fn settle_schedule(&self) {
        loop {
            let mut schedule = self.schedule.borrow_mut();
            let Some(first) = schedule.waiting.front() else { return };
            match first.claim.state() {
                ClaimState::Open => return,
                ClaimState::Rendered(tick) => {
                    let rendered = schedule.waiting.pop_front();
                    drop(schedule);
                    if let Some(rendered) = rendered {
                        self.enter_rendered(tick, rendered);
                    }
                }
                // Those after it build on it.
                ClaimState::Halted => drop_all(self, schedule, "the rig was stopped, faulted or disconnected"),
                ClaimState::Missed => drop_all(self, schedule, "its first change came after its tick"),
                ClaimState::Withdrawn => {
                    schedule.waiting.pop_front();
                }
            }
        }
    }

    fn enter_rendered(&self, tick: u64, rendered: WaitingChange) {
        let WaitingChange {
            revision,
            scene,
            ramp,
            path,
            step,
            entry,
            ..
        } = rendered;
        {
            let mut history = self.history.borrow_mut();
            let given = history.moved(step, scene);
            debug_assert_eq!(given, revision, "nothing came between");
            history.keep_ramp(ramp);
        }
        *self.ramp.borrow_mut() = path.map(|path| Ramp { revision, path });
        let entry = JournalEntry {
            tick: Some(tick),
            ..entry
        };
        self.enter(Completion::Done, entry);
    }

    /// Enters that changes were taken back.
    pub(super) fn enter_cancelled(&self, cancelled: usize, by: Option<&Peer>, why: &str) {
        let entry = JournalEntry {
            by: by.cloned(),
            message: Some(format!("{cancelled} scheduled changes were cancelled: {why}")),
            ..JournalEntry::of(if by.is_some() {
                "schedule.cancel"
            } else {
                "schedule_cancelled"
            })
        };
        self.enter(Completion::Done, entry);
    }
}

/// Removes all that waits, because the loop has discarded its first.
fn drop_all(rig: &RigHandle, mut schedule: std::cell::RefMut<'_, Schedule>, why: &str) {
    let dropped = schedule.waiting.len();
    schedule.withdraw(0);
    schedule.waiting.clear();
    drop(schedule);
    rig.enter_cancelled(dropped, None, why);
}
