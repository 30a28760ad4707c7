//! The host's own messages: their sequence, and the round trip to the first sample that names one.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::is_newer;

/// Sending times that are kept for the round trip: at 20 kHz more than a device can be behind without
/// its watchdog biting.
const KEPT: usize = 1024;

/// The messages of one conversation.
#[derive(Debug)]
pub(super) struct SentMessages {
    /// Sequence of the newest message.
    newest: u32,
    sent_at_ns: [u64; KEPT],
    /// Sequence of the newest message that a sample has named.
    echoed: u32,
}

impl SentMessages {
    pub(super) fn new() -> Self {
        Self {
            newest: 0,
            sent_at_ns: [0; KEPT],
            echoed: 0,
        }
    }

    /// The sequence of a message that is sent at a time of ours, ns.
    pub(super) fn next(&mut self, now_ns: u64) -> u32 {
        self.newest = self.newest.wrapping_add(1);
        self.sent_at_ns[self.newest as usize % KEPT] = now_ns;
        self.newest
    }

    /// Takes in the command that a sample names, at a time of ours, ns; returns its round trip, ns, the
    /// first time that it is named.
    pub(super) fn round_trip_ns(&mut self, command: u32, now_ns: u64) -> Option<u64> {
        if !is_newer(command, self.echoed) || is_newer(command, self.newest) {
            return None;
        }
        self.echoed = command;
        Some(now_ns.saturating_sub(self.sent_at_ns[command as usize % KEPT]))
    }
}
