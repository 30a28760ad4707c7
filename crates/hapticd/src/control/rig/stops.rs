//! Stops: raised at once, and confirmed when the device has taken the zero force.

use super::RigHandle;
use crate::control::journal::Completion;
use crate::rt::clock::now_ns;
use crate::rt::handoff::{StopConfirmation, Stopped};
use haptic_ipc::{ErrorCode, JournalEntry, Peer, RigState, StateChange, WireError};

impl RigHandle {
    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.shared.stops()
    }

    /// Asks for zero force at once; returns the number of the stop, for [`stopped`](Self::stopped).
    pub(crate) fn raise_stop(&self, by: &Peer) -> u64 {
        let stop = self.shared.stop();
        self.feed.borrow_mut().stop_begun(stop, now_ns());
        let before = self
            .feed
            .borrow()
            .newest()
            .map_or(RigState::Idle, |record| record.state);
        // Even a watcher may stop, again and again: a stop that changes nothing is not entered, so
        // that it cannot push other entries out of the journal.
        let changes_nothing = matches!(before, RigState::Stopped | RigState::Faulted);
        if !changes_nothing && !self.journal.borrow().waits_for_a_stop() {
            let after = RigState::Stopped;
            let entry = JournalEntry {
                by: Some(by.clone()),
                state: Some(StateChange { before, after }),
                ..JournalEntry::of("stop")
            };
            self.enter(Completion::Stopped(stop), entry);
        }
        stop
    }

    /// Waits until a stop has taken the force away; returns its tick and the state after it.
    ///
    /// # Errors
    /// No device is connected to take the zero force, or the real-time thread does not answer.
    pub(crate) async fn stopped(&self, stop: u64) -> Result<(u64, RigState), WireError> {
        let Stopped {
            tick,
            state,
            confirmation,
            ..
        } = self.answer(|answers| answers.stop(stop)).await?;
        let (code, what) = match confirmation {
            StopConfirmation::Confirmed => return Ok((tick, state)),
            StopConfirmation::NoDevice => (ErrorCode::NoDevice, "no device is connected to take the zero force"),
            StopConfirmation::Unconfirmed => (
                ErrorCode::NotConfirmed,
                "the device was sent the zero force and has not confirmed that its motor is off",
            ),
        };
        let message = format!(
            "the rig is {state}, but {what}: if the motor still pulls, cut its power (its own watchdog, if it has one, \
             switches it off)"
        );
        Err(WireError::new(code, message).about("device"))
    }
}
