//! Takes the records of the loop so far into the feed, the history and the journal, and reads what is only true after
//! that.

use super::RigHandle;
use crate::rt::inbox::ToLoop;
use crate::rt::outbox::TickRecord;
use crate::telemetry::feed::Feed;
use haptic_ipc::{LogReply, RigState, ServoSetup};
use std::cell::RefMut;

impl RigHandle {
    /// Exchanges with the real-time thread what waits on both sides, and processes its records.
    pub(crate) fn pump(&self) {
        // A scheduled scene that was rendered goes into the history. Where the caller reads that at this moment, all
        // waits for the next call.
        if self.history.try_borrow_mut().is_err() {
            return;
        }
        self.answers();
        // After the records: every scene that they name is in the history then.
        self.settle_schedule();
        let changes = self
            .feed
            .borrow_mut()
            .update_subscribers(self.history.borrow().scenes(), |record| self.servo_of(record));
        let is_snapshot_due = self.feed.borrow().is_snapshot_due();
        if is_snapshot_due && self.inbox.borrow_mut().send(ToLoop::Snapshot(Box::new(None))) {
            self.feed.borrow_mut().snapshot_asked();
        }
        self.keep_journal(&changes);
    }

    /// The feed, after every record of the loop so far: what a client was sent is in it.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.pump();
        self.feed.borrow_mut()
    }

    /// The settings that the loop's servo has from a record on.
    fn servo_of(&self, record: &TickRecord) -> Option<ServoSetup> {
        if record.input_word.has_new_limits()
            && let Some(limits) = self.sent_limits.take()
        {
            self.facts.set_limits(limits);
        }
        self.servo_in_use()
    }

    /// The state of the rig with no command under way, and a guard that keeps commands waiting.
    pub(in crate::control) async fn quiet_state(&self) -> (tokio::sync::MutexGuard<'_, ()>, RigState) {
        let turn = self.commanding.lock().await;
        (turn, self.state())
    }

    /// The rig's state in the newest record.
    pub(crate) fn state(&self) -> RigState {
        self.feed().state()
    }

    /// The newest entries of the journal.
    pub(crate) fn journal(&self, after: u64, limit: usize) -> LogReply {
        self.pump();
        self.journal.borrow().entries(after, limit)
    }
}
