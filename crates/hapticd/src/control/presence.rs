//! Connections and losses of a device, for the journal.
//!
//! There are two sources: the records of the loop have the exact tick of a loss, but not while the
//! rig is stopped or faulted; the link reports every loss, some milliseconds later. A device that only falls silent is
//! lost for the loop, and back with its next sample, on a link that was there all the time.

use device_io::link::{LinkMonitor, LinkState};
use std::sync::atomic::Ordering::Relaxed;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Lost,
    /// A device with this firmware was connected.
    Found {
        firmware: String,
    },
}

/// The state of the link that the journal knows.
#[derive(Debug, Default)]
pub(super) struct Presence {
    is_connected: bool,
    /// The loop reads it, on the connection on which it had lost it.
    is_read_again: bool,
    /// Connections made so far.
    connections: u64,
}

impl Presence {
    /// Notes a record without a device; returns whether that is a new loss.
    pub(super) fn lost(&mut self) -> bool {
        self.is_read_again = false;
        std::mem::replace(&mut self.is_connected, false)
    }

    /// Notes a record with a device.
    pub(super) fn read(&mut self) {
        self.is_read_again = !self.is_connected;
    }

    /// The changes of the link since the last call.
    pub(super) fn changes(&mut self, link: &LinkMonitor) -> Vec<Change> {
        let state = link.state();
        self.compare(&state, link.counters().connections.load(Relaxed))
    }

    fn compare(&mut self, state: &LinkState, connections: u64) -> Vec<Change> {
        let mut changes = Vec::new();
        match state {
            // The same connection; the loop may already know that it is lost.
            LinkState::Connected(_) if connections == self.connections && !self.is_read_again => {}
            LinkState::Connected(device) => {
                if self.lost() {
                    // The device was lost and came back between two calls.
                    changes.push(Change::Lost);
                }
                (self.is_connected, self.is_read_again, self.connections) = (true, false, connections);
                changes.push(Change::Found {
                    firmware: device.firmware.clone(),
                });
            }
            LinkState::Looking | LinkState::Waiting(_) => {
                if self.lost() {
                    changes.push(Change::Lost);
                }
            }
        }
        changes
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::control::rig_files::tests::device;

    /// A link with a device.
    pub(in crate::control) fn connected() -> LinkState {
        LinkState::Connected(device())
    }

    #[test]
    fn each_loss_and_each_return_is_reported_once() {
        let there = connected();
        let found = || Change::Found {
            firmware: device().firmware,
        };
        let mut presence = Presence::default();
        assert!(!presence.lost(), "it was never there");
        assert_eq!(presence.compare(&LinkState::Looking, 0), []);
        assert_eq!(presence.compare(&there, 1), [found()]);
        assert_eq!(presence.compare(&there, 1), []);
        // The loop sees it first.
        assert!(presence.lost() && !presence.lost());
        assert_eq!(presence.compare(&there, 1), []);
        assert_eq!(presence.compare(&LinkState::Looking, 1), []);
        assert_eq!(presence.compare(&there, 2), [found()]);
        // The rig is stopped, and only the link shows it.
        assert_eq!(presence.compare(&LinkState::Looking, 2), [Change::Lost]);
        assert_eq!(presence.compare(&there, 3), [found()]);
        // No look in between.
        assert_eq!(presence.compare(&there, 4), [Change::Lost, found()]);
        presence.read();
        assert_eq!(presence.compare(&there, 4), [], "it was there all the time");
        // It was silent for a while.
        assert!(presence.lost());
        assert_eq!(presence.compare(&there, 4), []);
        presence.read();
        assert_eq!(presence.compare(&there, 4), [found()]);
        assert!(presence.lost(), "the next loss is reported as well");
        // The loop reads the next connection before the link is looked at.
        presence.read();
        assert_eq!(presence.compare(&there, 5), [found()]);
        assert_eq!(presence.compare(&there, 5), []);
    }
}
