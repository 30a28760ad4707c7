//! How a link is: counters that the real-time thread writes and anybody reads, without ever waiting for each other.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};

/// Written by the real-time thread alone. Each stands for itself, so no order between them is needed.
#[derive(Debug, Default)]
pub struct LinkCounters {
    /// Samples taken.
    pub samples: AtomicU64,
    /// Samples that the device numbered and that never came, or came after a newer one.
    pub lost: AtomicU64,
    /// Frames with a wrong CRC, or broken off.
    pub bad_crc: AtomicU64,
    /// Messages of another version, kind or length, or with impossible values.
    pub malformed: AtomicU64,
    /// Samples that were not newer than the newest: doubled or overtaken on their way.
    pub out_of_sequence: AtomicU64,
    /// Samples that came more than a period later than they should.
    pub late: AtomicU64,
    /// Commands that the link had no room for.
    pub not_sent: AtomicU64,
    /// Commands cut to the device's own force limit.
    pub clipped: AtomicU64,
    /// From a command's sending to the arrival of the first sample that knows it, newest, ns.
    pub round_trip_ns: AtomicU64,
    /// The longest of those, ns.
    pub round_trip_max_ns: AtomicU64,
    /// What those usually are: the mean of the last hundred or so, ns. 0 before the first.
    pub usual_round_trip_ns: AtomicU64,
    /// How old the newest sample was when it was last used, beyond what the quickest ones take to come, ns.
    pub age_ns: AtomicU64,
    /// How old a sample usually gets before the next one is there, beyond what the quickest ones take to come, ns: the greatest of the last thousand ticks or so.
    pub usual_age_ns: AtomicU64,
    /// How much faster the device's clock runs than ours, parts in 1e9; `i64::MIN` where that is not known yet.
    pub drift_ppb: AtomicI64,
    /// Connections made.
    pub connections: AtomicU64,
    /// Errors that the device reported.
    pub device_errors: AtomicU64,
    /// Buttons pressed, one bit each.
    pub buttons: AtomicU64,
}

impl LinkCounters {
    /// Notes how long a command and the sample that knows it took, ns.
    pub(crate) fn note_round_trip(&self, round_trip_ns: u64) {
        self.round_trip_ns.store(round_trip_ns, Relaxed);
        self.round_trip_max_ns
            .store(round_trip_ns.max(self.round_trip_max_ns.load(Relaxed)), Relaxed);
        let usual_ns = match self.usual_round_trip_ns.load(Relaxed) {
            0 => round_trip_ns,
            usual_ns => usual_ns - usual_ns / MEAN_OF + round_trip_ns / MEAN_OF,
        };
        self.usual_round_trip_ns.store(usual_ns.max(1), Relaxed);
    }

    /// Notes how old the newest sample is in a tick, and how much of that is beyond what the quickest ones take to come, ns.
    pub(crate) fn note_age(&self, age_ns: u64, beyond_ns: u64) {
        self.age_ns.store(age_ns, Relaxed);
        let greatest_ns = self.usual_age_ns.load(Relaxed);
        self.usual_age_ns
            .store(beyond_ns.max(greatest_ns - greatest_ns / FORGOTTEN_AFTER), Relaxed);
    }

    /// Forgets what is measured of one conversation: the next may be with another device.
    pub(crate) fn begin_conversation(&self) {
        self.drift_ppb.store(UNKNOWN_DRIFT, Relaxed);
        self.usual_round_trip_ns.store(0, Relaxed);
        self.usual_age_ns.store(0, Relaxed);
        add(&self.connections, 1);
    }
}

/// Round trips that their mean is taken over.
const MEAN_OF: u64 = 128;

/// Ticks after which a greatest age has sunk to a third.
const FORGOTTEN_AFTER: u64 = 1024;

/// What `drift_ppb` holds where the drift is not known.
pub const UNKNOWN_DRIFT: i64 = i64::MIN;

/// Adds to a counter whose only writer is the caller: no read-modify-write, which some processors make of a loop.
pub(crate) fn add(counter: &AtomicU64, count: u64) {
    counter.store(counter.load(Relaxed).wrapping_add(count), Relaxed);
}
