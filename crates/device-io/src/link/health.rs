//! How a link is: counters that the real-time thread writes and anybody reads, without ever waiting for each other.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::{ErrorCode, ErrorReport};
use std::fmt;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};

/// Written by the real-time thread alone. Each stands for itself, so no order between them is needed.
#[derive(Debug, Default)]
pub struct LinkCounters {
    /// Samples taken.
    pub samples: AtomicU64,
    /// Samples that the device numbered and that never came, or came after a newer one.
    pub lost: AtomicU64,
    /// Jumps of the device's sequence that are too long for lost samples.
    pub sequence_jumps: AtomicU64,
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
    /// The last error, as a word, and when it was, ns.
    last_error: AtomicU64,
    last_error_at_ns: AtomicU64,
    /// Since when a device that is there is asked who it is, ns; 0 where none is.
    asking_since_ns: AtomicU64,
}

/// What went wrong on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkError {
    /// The system could not read it, and said so by a number.
    Read(i32),
    /// The system could not write to it, and said so by a number.
    Write(i32),
    /// The other end has hung up.
    HungUp,
    /// It has taken nothing for too long.
    Stuck,
    /// The device has sent nothing for too long.
    Silent,
    /// The device has reported an error.
    Device(ErrorReport),
}

impl LinkError {
    /// A kind in the upper bits, what the device calls it in the middle, and a number below. No word is 0.
    fn word(self) -> u64 {
        let number = |kind: u64, number: i32| kind << 56 | u64::from(number.cast_unsigned());
        match self {
            Self::Read(errno) => number(1, errno),
            Self::Write(errno) => number(2, errno),
            Self::HungUp => number(3, 0),
            Self::Stuck => number(4, 0),
            Self::Silent => number(5, 0),
            Self::Device(ErrorReport { code, detail }) => 6 << 56 | u64::from(code as u8) << 32 | u64::from(detail),
        }
    }

    fn of_word(word: u64) -> Option<Self> {
        let [kind, _, _, code, number @ ..] = word.to_be_bytes();
        let number = u32::from_be_bytes(number);
        Some(match kind {
            1 => Self::Read(number.cast_signed()),
            2 => Self::Write(number.cast_signed()),
            3 => Self::HungUp,
            4 => Self::Stuck,
            5 => Self::Silent,
            6 => Self::Device(ErrorReport {
                code: ErrorCode::from_byte(code),
                detail: number,
            }),
            _ => return None,
        })
    }
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let said = |errno: i32| std::io::Error::from_raw_os_error(errno);
        match *self {
            Self::Read(errno) => write!(f, "reading it failed: {}", said(errno)),
            Self::Write(errno) => write!(f, "writing to it failed: {}", said(errno)),
            Self::HungUp => f.write_str("it was hung up"),
            Self::Stuck => f.write_str("it took no command for too long"),
            Self::Silent => f.write_str("the device sent nothing for too long"),
            Self::Device(report) => write!(f, "the device reported: {report}"),
        }
    }
}

impl LinkCounters {
    /// Notes how long a command and the sample that knows it took, ns.
    pub fn note_round_trip(&self, round_trip_ns: u64) {
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
    pub fn note_age(&self, age_ns: u64, beyond_ns: u64) {
        self.age_ns.store(age_ns, Relaxed);
        let greatest_ns = self.usual_age_ns.load(Relaxed);
        self.usual_age_ns
            .store(beyond_ns.max(greatest_ns - greatest_ns / FORGOTTEN_AFTER), Relaxed);
    }

    /// Notes that so many samples are missing before one that has come.
    pub(crate) fn note_gap(&self, missing: u32) {
        if missing <= MOST_LOST {
            add(&self.lost, u64::from(missing));
        } else {
            add(&self.sequence_jumps, 1);
        }
    }

    /// Notes what has gone wrong, at a time of ours, ns.
    pub fn note_error(&self, error: LinkError, now_ns: u64) {
        self.last_error.store(error.word(), Relaxed);
        self.last_error_at_ns.store(now_ns, Relaxed);
    }

    /// The last thing that went wrong, and when that was on the monotonic clock, ns.
    #[must_use]
    pub fn last_error(&self) -> Option<(LinkError, u64)> {
        let error = LinkError::of_word(self.last_error.load(Relaxed))?;
        Some((error, self.last_error_at_ns.load(Relaxed)))
    }

    /// A device that is there is asked who it is, from a time of ours on, ns, and as long as what this returns lives.
    #[must_use]
    pub fn ask(&self, now_ns: u64) -> Asking<'_> {
        self.asking_since_ns.store(now_ns.max(1), Relaxed);
        Asking(self)
    }

    /// Since when a device that is there is asked who it is, on the monotonic clock, ns.
    #[must_use]
    pub fn asking_since_ns(&self) -> Option<u64> {
        Some(self.asking_since_ns.load(Relaxed)).filter(|since_ns| *since_ns > 0)
    }

    /// Forgets what is measured of one conversation: the next may be with another device.
    pub fn begin_conversation(&self) {
        self.drift_ppb.store(UNKNOWN_DRIFT, Relaxed);
        self.usual_round_trip_ns.store(0, Relaxed);
        self.usual_age_ns.store(0, Relaxed);
        add(&self.connections, 1);
    }
}

/// A device is being asked who it is.
#[derive(Debug)]
pub struct Asking<'a>(&'a LinkCounters);

impl Drop for Asking<'_> {
    fn drop(&mut self) {
        self.0.asking_since_ns.store(0, Relaxed);
    }
}

/// Samples that can be missing at once: those of half a second, after which the device counts as gone, at the highest rate of the protocol.
const MOST_LOST: u32 = 50_000;

/// Round trips that their mean is taken over.
const MEAN_OF: u64 = 128;

/// Ticks after which a greatest age has sunk to a third.
const FORGOTTEN_AFTER: u64 = 1024;

/// What `drift_ppb` holds where the drift is not known.
pub const UNKNOWN_DRIFT: i64 = i64::MIN;

/// Adds to a counter whose only writer is the caller: no read-modify-write, which some processors make of a loop.
pub fn add(counter: &AtomicU64, count: u64) {
    counter.store(counter.load(Relaxed).wrapping_add(count), Relaxed);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_survives_its_word() {
        let counters = LinkCounters::default();
        assert_eq!(counters.last_error(), None);
        for error in [
            LinkError::Read(5),
            LinkError::Write(19),
            LinkError::HungUp,
            LinkError::Stuck,
            LinkError::Silent,
            LinkError::Device(ErrorReport {
                code: ErrorCode::Other,
                detail: u32::MAX,
            }),
        ] {
            counters.note_error(error, 7);
            assert_eq!(counters.last_error(), Some((error, 7)));
        }
        assert_eq!(
            LinkError::Read(5).to_string(),
            "reading it failed: Input/output error (os error 5)"
        );
    }
}
