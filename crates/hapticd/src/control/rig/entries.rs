//! Entries of the journal, completed by the loop's records.

use super::RigHandle;
use super::observed_state::ObservedState;
use crate::control::journal::Completion;
use crate::control::presence;
use crate::log::Level;
use crate::rt::handoff::{StopConfirmation, Stopped};
use crate::rt::outbox::TickRecord;
use haptic_core::servo::Fault;
use haptic_ipc::{JournalEntry, RigState, StateChange};
use std::time::Instant;

impl RigHandle {
    /// Enters events that no client asked for, completes the entries that waited for their tick,
    /// and notifies the subscribers.
    pub(super) fn keep_journal(&self, changes: &[TickRecord]) {
        self.enter_own_events(changes);
        let complete = self
            .journal
            .borrow_mut()
            .completed(|until, entry| self.complete(until, entry, changes));
        let feed = self.feed.borrow();
        let now = Instant::now();
        let mut link_log = self.link_log.borrow_mut();
        for entry in &complete {
            let is_of_link = matches!(entry.op.as_str(), "connected" | "disconnected");
            if !is_of_link || link_log.admits(now) {
                crate::log::journal(entry);
            }
            feed.send_entry(entry);
        }
    }

    /// Writes to the log what is due about the link. It is looked at for that now and then, not with every request.
    pub(crate) fn log_link(&self) {
        let Some(link) = &self.facts.link else { return };
        let lines = self
            .link_log
            .borrow_mut()
            .lines(Instant::now(), &link.state(), link.failed_attempts());
        for line in lines {
            crate::log::say_at(Level::Warning, &line);
        }
    }

    /// Enters events that no client asked for: a fault, a release by the enable button, a device
    /// lost or found.
    fn enter_own_events(&self, changes: &[TickRecord]) {
        let mut journal = self.journal.borrow_mut();
        let enable_button = self.facts.servo.get().enable_button;
        for record in changes {
            let now = ObservedState::of(record, enable_button);
            if let Some((op, message)) = now.change_since(self.observed.replace(now)) {
                let entry = JournalEntry {
                    tick: Some(record.tick),
                    revision: record.revision,
                    message: Some(message),
                    fault: record.fault.map(|fault| fault.code().to_owned()),
                    ..JournalEntry::of(op)
                };
                journal.enter(Completion::Done, entry);
            }
            let mut presence = self.presence.borrow_mut();
            match record.state {
                RigState::Disconnected if presence.lost() => {
                    journal.enter(Completion::Done, self.lost(Some(record.tick)));
                }
                // A stop or a fault stays whether there is a device or not.
                RigState::Disconnected | RigState::Stopped | RigState::Faulted => {}
                _ => presence.read(),
            }
        }
        let Some(link) = &self.facts.link else { return };
        for change in self.presence.borrow_mut().changes(link) {
            let entry = match change {
                presence::Change::Lost => self.lost(None),
                presence::Change::Found { firmware } => JournalEntry {
                    message: Some(format!("{}: {firmware}", self.facts.device)),
                    revision: self.revision(),
                    ..JournalEntry::of("connected")
                },
            };
            journal.enter(Completion::Done, entry);
        }
    }

    /// Completes an entry if the event that it waits for has happened.
    fn complete(&self, until: Completion, entry: &mut JournalEntry, changes: &[TickRecord]) -> bool {
        match until {
            Completion::Done => true,
            Completion::Rendered(revision) => {
                // A record at hand names the exact tick.
                let seen = changes.iter().find(|record| record.revision >= revision);
                let tick = seen
                    .map(|record| record.tick)
                    .or_else(|| self.feed.borrow().answers().applied(revision));
                entry.tick = tick;
                tick.is_some()
            }
            Completion::Stopped(stop) => {
                let Some(Stopped {
                    tick,
                    state,
                    confirmation,
                    ..
                }) = self.feed.borrow().answers().stop(stop)
                else {
                    return false;
                };
                entry.tick = Some(tick);
                entry.state = entry.state.map(|change| StateChange { after: state, ..change });
                entry.message = match confirmation {
                    StopConfirmation::Confirmed => None,
                    StopConfirmation::Unconfirmed => {
                        Some("the device has not confirmed that its motor is off".to_owned())
                    }
                    StopConfirmation::NoDevice => Some("no device was connected to take the zero force".to_owned()),
                };
                true
            }
        }
    }

    /// The entry of a device that can no longer be read, since this tick if that is known.
    fn lost(&self, tick: Option<u64>) -> JournalEntry {
        JournalEntry {
            tick,
            revision: self.revision(),
            message: Some(self.facts.device.clone()),
            ..JournalEntry::of("disconnected")
        }
    }

    /// Enters an entry into the journal, at the newest revision.
    pub(crate) fn enter(&self, until: Completion, entry: JournalEntry) {
        let revision = self.revision();
        self.journal
            .borrow_mut()
            .enter(until, JournalEntry { revision, ..entry });
    }

    /// Times that each fault, or the rig's stop button, took the force away, by its code; also those that never did.
    pub(crate) fn faults(&self) -> [(&'static str, u64); Fault::KINDS.len()] {
        let journal = self.journal.borrow();
        Fault::KINDS.map(|fault| {
            let code = fault.code();
            (code, journal.faults().get(code).copied().unwrap_or(0))
        })
    }
}
