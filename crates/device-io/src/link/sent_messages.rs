//! The host's own messages: their sequence, those that the device has not confirmed yet, and the round trip to the
//! first sample that names one.
//!
//! What was sent and not confirmed may still lie in a queue, of the system, of a converter or of the device, and will
//! act when it comes out of it. So its number and its age are bounded.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::is_newer;

/// Most messages that may be unconfirmed while another is sent.
const MAX_UNCONFIRMED: u32 = 20;

/// Longest time for which one may be unconfirmed while another is sent, ns; a sample period is added. The 16 ms for
/// which an FTDI collects samples fit in.
const MAX_UNCONFIRMED_NS: u64 = 20_000_000;

/// Sending times that are kept: those of all that may be unconfirmed, and of two seconds of zero forces beyond them.
const KEPT: usize = 256;

/// A message that was sent.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    sequence: u32,
    at_ns: u64,
}

/// The messages of one conversation.
#[derive(Debug)]
pub(super) struct SentMessages {
    /// Sequence of the newest message.
    newest: u32,
    kept: [Sent; KEPT],
    /// Sequence of the newest message that a sample has named.
    confirmed: u32,
    /// When that came, or the first unconfirmed message was sent after it, ns.
    waiting_since_ns: u64,
    longest_ns: u64,
}

impl SentMessages {
    /// To a device with a sample period, ns.
    pub(super) fn new(sample_period_ns: u64) -> Self {
        Self {
            newest: 0,
            kept: [Sent::default(); KEPT],
            confirmed: 0,
            waiting_since_ns: 0,
            longest_ns: MAX_UNCONFIRMED_NS + sample_period_ns,
        }
    }

    /// The sequence of a message that is sent at a time of ours, ns.
    pub(super) fn next(&mut self, now_ns: u64) -> u32 {
        if self.newest == self.confirmed {
            self.waiting_since_ns = now_ns;
        }
        self.newest = self.newest.wrapping_add(1);
        self.kept[self.newest as usize % KEPT] = Sent {
            sequence: self.newest,
            at_ns: now_ns,
        };
        self.newest
    }

    /// When the newest message was sent, ns.
    pub(super) fn newest_at_ns(&self) -> u64 {
        self.sent_at_ns(self.newest)
    }

    /// When a message was sent, ns; the oldest that is known, where it was sent before that.
    fn sent_at_ns(&self, sequence: u32) -> u64 {
        let kept = self.kept[sequence as usize % KEPT];
        if kept.sequence == sequence {
            return kept.at_ns;
        }
        // The place after the newest holds the oldest.
        self.kept[(self.newest as usize + 1) % KEPT].at_ns
    }

    /// Whether another message may be sent at a time of ours, ns: few are unconfirmed, and none of them is old.
    pub(super) fn has_room(&self, now_ns: u64) -> bool {
        let unconfirmed = self.newest.wrapping_sub(self.confirmed);
        let oldest_at_ns = self.sent_at_ns(self.confirmed.wrapping_add(1));
        unconfirmed == 0 || unconfirmed < MAX_UNCONFIRMED && now_ns.saturating_sub(oldest_at_ns) <= self.longest_ns
    }

    /// Takes in the command that a sample names, at a time of ours, ns; returns its round trip, ns, the
    /// first time that it is named.
    pub(super) fn round_trip_ns(&mut self, command: u32, now_ns: u64) -> Option<u64> {
        if !is_newer(command, self.confirmed) || is_newer(command, self.newest) {
            return None;
        }
        self.confirmed = command;
        self.waiting_since_ns = now_ns;
        Some(now_ns.saturating_sub(self.sent_at_ns(command)))
    }

    /// For how long the device has taken samples without confirming anything, ns, by the time of ours of its newest
    /// sample, ns.
    pub(super) fn waiting_ns(&self, sampled_ns: u64) -> u64 {
        if self.newest == self.confirmed {
            return 0;
        }
        sampled_ns.saturating_sub(self.waiting_since_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn round_trip_spans_any_number_of_later_commands() {
        for behind in [1, 2, 255, 256, 257, 1024, 1050, 5000] {
            let mut sent = SentMessages::new(MS);
            for k in 0..6000 {
                sent.next(k * MS);
            }
            let command = 6000 - behind;
            let measured_ns = sent.round_trip_ns(command, 6000 * MS).expect("newer than none");
            let true_ns = (u64::from(behind) + 1) * MS;
            // Of what is not kept any more, at least as much as is known.
            assert!(
                measured_ns == true_ns || behind >= 256 && (256 * MS..true_ns).contains(&measured_ns),
                "{behind}: {measured_ns}"
            );
            assert_eq!(sent.round_trip_ns(command, 6000 * MS), None, "named once");
        }
    }

    proptest! {
        // hazard: H23
        /// Whatever a device confirms, and when: what is sent while there is room keeps both bounds.
        #[test]
        fn what_is_unconfirmed_is_bounded(confirms in prop::collection::vec((0..3_u32, 1..2_000_000_u64), 1..400)) {
            let mut sent = SentMessages::new(MS);
            let mut open: std::collections::VecDeque<(u32, u64)> = std::collections::VecDeque::new();
            let mut now_ns = MS;
            for (confirmed, later_ns) in confirms {
                now_ns += later_ns;
                for _ in 0..confirmed {
                    if let Some((sequence, at_ns)) = open.pop_front() {
                        prop_assert_eq!(sent.round_trip_ns(sequence, now_ns), Some(now_ns - at_ns));
                    }
                }
                let old = open.front().is_some_and(|(_, at_ns)| now_ns - at_ns > 21 * MS);
                prop_assert_eq!(sent.has_room(now_ns), open.len() < 20 && !old);
                if sent.has_room(now_ns) {
                    open.push_back((sent.next(now_ns), now_ns));
                }
            }
        }
    }
}
