//! The journal, as the loop's records and the link bring its entries about and complete them.

use crate::control::facts::Facts;
use crate::control::journal::{Completion, Journal};
use crate::control::link_log::LinkLog;
use crate::control::presence::{Change, Presence};
use crate::log::Level;
use crate::rt::clock::now_ns;
use crate::rt::handoff::{StopConfirmation, Stopped};
use crate::rt::outbox::{Answers, TickRecord};
use device_io::link::{LinkError, LinkMonitor};

use haptic_core::sample::DeviceError;
use haptic_core::servo::Fault;
use haptic_ipc::{JournalEntry, RigState, StateChange};
use std::time::Instant;

/// Age up to which an error of the link is why its device is lost, ns.
const RECENT_NS: u64 = 2_000_000_000;

/// The journal, and what it has seen of the rig.
#[derive(Debug, Default)]
pub(super) struct RigJournal {
    pub(super) entries: Journal,
    /// The newest record of a change.
    observed: ObservedState,
    presence: Presence,
    link_log: LinkLog,
    /// The newest tick in which force began to be let out, and the states around it.
    released: Option<(u64, StateChange)>,
    /// The tick of the newest release that has an entry.
    release_entered: Option<u64>,
}

impl RigJournal {
    /// The tick and the states of a release: as its command's outcome has them, or, where the loop had released by
    /// itself before the command came (`own`), those of that. Absent where there is nothing to enter.
    pub(super) fn release(&mut self, own: bool, outcome: (u64, StateChange)) -> Option<(u64, StateChange)> {
        let entered = self.release_entered;
        let released = if own {
            self.released.filter(|(tick, _)| Some(*tick) > entered)
        } else {
            Some(outcome)
        };
        self.release_entered = released.map(|(tick, _)| tick).or(entered);
        released
    }

    /// Enters events that no client asked for, and completes the entries that waited for their tick: returns them, and
    /// writes them to the log.
    pub(super) fn completed(
        &mut self,
        facts: &Facts,
        revision: u64,
        changes: &[TickRecord],
        answers: Answers,
    ) -> Vec<JournalEntry> {
        self.enter_own_events(facts, revision, changes);
        let complete = self
            .entries
            .completed(|until, entry| complete(until, entry, changes, answers));
        let now = Instant::now();
        for entry in &complete {
            let is_of_link = matches!(entry.op.as_str(), "connected" | "disconnected");
            if !is_of_link || self.link_log.admits(now) {
                crate::log::journal(entry);
            }
        }
        complete
    }

    /// Enters a fault, a release by the enable button, a device lost or found.
    fn enter_own_events(&mut self, facts: &Facts, revision: u64, changes: &[TickRecord]) {
        // The entry of a device, since this tick if that is known.
        let of_device = |op: &str, tick: Option<u64>, message: String| JournalEntry {
            tick,
            revision,
            message: Some(message),
            ..JournalEntry::of(op)
        };
        let lost = |tick, message| of_device("disconnected", tick, message);
        let enable_button = facts.servo.get().enable_button;
        for record in changes {
            let now = ObservedState::of(record, enable_button);
            let before = std::mem::replace(&mut self.observed, now);
            let event = now.change_since(before);
            let change = StateChange {
                before: before.state.unwrap_or(record.state),
                after: record.state,
            };
            let is_let_out = matches!(change.after, RigState::Releasing | RigState::Idle);
            if before.had_force() && is_let_out && event.is_none() {
                self.released = Some((record.tick, change));
            }
            if let Some((op, message)) = event {
                let entry = JournalEntry {
                    tick: Some(record.tick),
                    revision: record.revision,
                    message: Some(message),
                    fault: record.fault.map(|fault| fault.code().to_owned()),
                    ..JournalEntry::of(op)
                };
                self.entries.enter(Completion::Done, entry);
            }
            match record.state {
                RigState::Disconnected if self.presence.lost() => {
                    let device = &facts.device;
                    // Where the link holds, nobody need look for a plug.
                    let message = match record.input_word.sample(0, 0, 0.0) {
                        Err(DeviceError::Disconnected) => device.clone(),
                        Err(error) => format!("{device}: {error}"),
                        Ok(_) => match facts.link.as_ref().and_then(recent_error) {
                            Some(error) => format!("{device}: {error}"),
                            None => format!("{device}: no new sample came in time"),
                        },
                    };
                    let entry = JournalEntry {
                        state: (change.before != change.after).then_some(change),
                        ..lost(Some(record.tick), message)
                    };
                    self.entries.enter(Completion::Done, entry);
                }
                // A stop or a fault stays whether there is a device or not.
                RigState::Disconnected | RigState::Stopped | RigState::Faulted => {}
                _ => self.presence.read(),
            }
        }
        let Some(link) = &facts.link else { return };
        for change in self.presence.changes(link) {
            let entry = match change {
                Change::Lost => {
                    let why = recent_error(link).map_or_else(String::new, |error| format!(": {error}"));
                    lost(None, format!("{}{why}", facts.device))
                }
                Change::Found { firmware } => of_device("connected", None, format!("{}: {firmware}", facts.device)),
            };
            self.entries.enter(Completion::Done, entry);
        }
    }

    /// Writes to the log what is due about the link.
    pub(super) fn log_link(&mut self, link: &LinkMonitor) {
        let lines = self
            .link_log
            .lines(Instant::now(), &link.state(), link.failed_attempts());
        for line in lines {
            crate::log::say_at(Level::Warning, &line);
        }
    }
}

/// Completes an entry if the event that it waits for has happened.
fn complete(until: Completion, entry: &mut JournalEntry, changes: &[TickRecord], answers: Answers) -> bool {
    match until {
        Completion::Done => true,
        Completion::Rendered(revision) => {
            // A record at hand names the exact tick.
            let seen = changes.iter().find(|record| record.revision >= revision);
            entry.tick = seen.map(|record| record.tick).or_else(|| answers.applied(revision));
            entry.tick.is_some()
        }
        Completion::Stopped(stop) => {
            let Some(Stopped {
                tick,
                state,
                confirmation,
                ..
            }) = answers.stop(stop)
            else {
                return false;
            };
            entry.tick = Some(tick);
            entry.state = entry.state.map(|change| StateChange { after: state, ..change });
            entry.message = match confirmation {
                StopConfirmation::Confirmed => None,
                StopConfirmation::Unconfirmed => Some("the device has not confirmed that its motor is off".to_owned()),
                StopConfirmation::NoDevice => Some("no device was connected to take the zero force".to_owned()),
            };
            true
        }
    }
}

/// State and fault of the newest record, and whether the rig's enable button is let go of in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ObservedState {
    state: Option<RigState>,
    fault: Option<Fault>,
    is_enable_button_open: bool,
}

impl ObservedState {
    /// What a record shows of a rig that force wants this button for, by its bit.
    fn of(record: &TickRecord, enable_button: Option<u8>) -> Self {
        Self {
            state: Some(record.state),
            fault: record.fault,
            is_enable_button_open: enable_button.is_some_and(|button| !record.input_word.is_pressed(button)),
        }
    }

    /// Whether force was let in, or was being let in.
    const fn had_force(self) -> bool {
        matches!(self.state, Some(RigState::Engaging | RigState::Engaged))
    }

    /// An event that no client asked for: the name of its journal entry, and its message.
    fn change_since(self, before: Self) -> Option<(&'static str, String)> {
        if let Some(fault) = self.fault.filter(|_| self.fault != before.fault) {
            let op = if self.state == Some(RigState::Faulted) {
                "fault"
            } else {
                "stop"
            };
            return Some((op, fault.to_string()));
        }
        // A ramp that is over within a tick leads from force to idle, too: the client that asked for it, or the lease
        // that lapsed, has an entry of its own.
        (before.had_force() && self.state == Some(RigState::Idle) && self.is_enable_button_open)
            .then(|| ("release", "the rig's enable button was released".to_owned()))
    }
}

/// Why the link has just lost its device, where it knows.
fn recent_error(link: &LinkMonitor) -> Option<LinkError> {
    let (error, at_ns) = link.counters().last_error()?;
    (now_ns().saturating_sub(at_ns) < RECENT_NS).then_some(error)
}
