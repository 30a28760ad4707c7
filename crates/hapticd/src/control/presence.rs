//! Whether the device of a link is there, as the journal tells it.
//!
//! Two sources: the records of the loop tell the very tick at which a device was lost, but nothing
//! while the rig is stopped or faulted; the link tells that too, some milliseconds later.

use device_io::link::{LinkMonitor, LinkState};
use std::sync::atomic::Ordering::Relaxed;

/// Something that has happened to the link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Lost,
    /// A device with this firmware.
    Found {
        firmware: String,
    },
}

/// What is known of the link.
#[derive(Debug, Default)]
pub(super) struct Presence {
    is_connected: bool,
    /// Connections made so far.
    connections: u64,
}

impl Presence {
    /// The loop has a record without a device; returns whether that is news.
    pub(super) fn lost(&mut self) -> bool {
        std::mem::replace(&mut self.is_connected, false)
    }

    /// What has happened since, as the link tells it.
    pub(super) fn look(&mut self, link: &LinkMonitor) -> Vec<Change> {
        let state = link.state();
        self.compare(&state, link.counters().connections.load(Relaxed))
    }

    fn compare(&mut self, state: &LinkState, connections: u64) -> Vec<Change> {
        let mut changes = Vec::new();
        match state {
            // The same connection, of which the loop may know already that it is lost.
            LinkState::Connected { .. } if connections == self.connections => {}
            LinkState::Connected { device, .. } => {
                if self.lost() {
                    // It came back between two looks.
                    changes.push(Change::Lost);
                }
                (self.is_connected, self.connections) = (true, connections);
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
mod tests {
    use super::*;

    #[test]
    fn each_loss_and_each_return_is_told_once() {
        let there = LinkState::Connected {
            device: device_io::link::DeviceFacts {
                firmware: "f".to_owned(),
                force_limit_n: 1.0,
                sample_rate_hz: 1000.0,
                resolution_m: 1e-5,
                watchdog_ms: Some(50),
                rig: device_io::link::RigIdentity::default(),
            },
            connection: 1,
        };
        let found = || Change::Found {
            firmware: "f".to_owned(),
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
        // The rig is stopped, and the link alone tells.
        assert_eq!(presence.compare(&LinkState::Looking, 2), [Change::Lost]);
        assert_eq!(presence.compare(&there, 3), [found()]);
        // No look in between.
        assert_eq!(presence.compare(&there, 4), [Change::Lost, found()]);
    }
}
