//! The health of a link: counters that the real-time thread writes and other threads read, without
//! ever waiting for each other.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::{ErrorCode, ErrorReport};
use std::fmt;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64};

/// The counters of a link. Only the real-time thread writes them. They do not depend on each other,
/// so they need no order.
#[derive(Debug, Default)]
pub struct LinkCounters {
    /// Samples taken.
    pub samples: AtomicU64,
    /// Samples that never came, or came after a newer one, by the device's numbers.
    pub lost: AtomicU64,
    /// Jumps of the device's sequence that are too long for lost samples.
    pub sequence_jumps: AtomicU64,
    /// Frames with a wrong CRC, or broken off.
    pub bad_crc: AtomicU64,
    /// Messages of another version, kind or length, or with impossible values.
    pub malformed: AtomicU64,
    /// Samples that were not newer than the newest: duplicated, or overtaken on their way.
    pub out_of_sequence: AtomicU64,
    /// Samples that came more than a period too late.
    pub late: AtomicU64,
    /// Commands for which the link had no room, or that waited because too much was unconfirmed.
    pub not_sent: AtomicU64,
    /// Commands cut to the device's own force limit.
    pub clipped: AtomicU64,
    /// Newest round trip, from the sending of a command to the first sample that names it, ns.
    pub round_trip_ns: AtomicU64,
    /// Longest round trip, ns.
    pub round_trip_max_ns: AtomicU64,
    /// Usual round trip: the mean of about the last hundred, ns. 0 before the first.
    pub usual_round_trip_ns: AtomicU64,
    /// Steady round trip, than which about a quarter are quicker, ns; 0 before the first. What comes late now and then
    /// is no part of it.
    pub steady_round_trip_ns: AtomicU64,
    /// Time between two samples by the device's clock: the mean of some before the newest, ns. 0 before the first mean.
    pub period_ns: AtomicU64,
    /// Newest round trip that force may not have, ns; 0 before the first.
    pub late_round_trip_ns: AtomicU64,
    /// Share of such of about the last hundred round trips, parts in 1e6.
    late_ppm: AtomicU64,
    /// The device confirms no command at present.
    is_ignoring: AtomicBool,
    /// Age of the newest sample at its last use, beyond the transfer of the quickest samples, ns.
    pub age_ns: AtomicU64,
    /// Usual age of a sample when the next one comes, beyond the transfer of the quickest samples, ns:
    /// the largest of about the last thousand ticks.
    pub usual_age_ns: AtomicU64,
    /// Drift of the device's clock against ours, parts in 1e9, positive where it is faster;
    /// [`UNKNOWN_DRIFT`] until it is known.
    pub drift_ppb: AtomicI64,
    /// Connections made.
    pub connections: AtomicU64,
    /// Errors that the device reported.
    pub device_errors: AtomicU64,
    /// Buttons pressed, one bit each.
    pub buttons: AtomicU64,
    /// The last error, as a word, and its time, ns.
    last_error: AtomicU64,
    last_error_at_ns: AtomicU64,
    /// Time of the first unanswered question to a device that is there, ns; 0 without such a
    /// device.
    asking_since_ns: AtomicU64,
}

/// What becomes of commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// The device confirms them in time.
    InTime,
    /// It confirms many of them too late for force to flow.
    Late,
    /// It sends samples and confirms none.
    Ignored,
}

/// What went wrong on a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkError {
    /// The system could not read it, with this error number.
    Read(i32),
    /// The system could not write to it, with this error number.
    Write(i32),
    /// The other end has hung up.
    HungUp,
    /// It has taken nothing for too long.
    Stuck,
    /// The device has sent nothing for too long.
    Silent,
    /// This program stood still for so long that the device has fallen silent, ms.
    Standstill(u32),
    /// The device has reported an error.
    Device(ErrorReport),
}

impl LinkError {
    /// That this program stood still, for a time, ns.
    pub(crate) fn standstill(lasted_ns: u64) -> Self {
        Self::Standstill(u32::try_from(lasted_ns / 1_000_000).unwrap_or(u32::MAX))
    }

    /// The kind in the upper bits, the device's code in the middle, and a number below. No word is
    /// 0.
    fn word(self) -> u64 {
        let number = |kind: u64, number: i32| kind << 56 | u64::from(number.cast_unsigned());
        match self {
            Self::Read(errno) => number(1, errno),
            Self::Write(errno) => number(2, errno),
            Self::HungUp => number(3, 0),
            Self::Stuck => number(4, 0),
            Self::Silent => number(5, 0),
            Self::Standstill(ms) => 7 << 56 | u64::from(ms),
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
            7 => Self::Standstill(number),
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
        let message = |errno: i32| std::io::Error::from_raw_os_error(errno);
        match *self {
            Self::Read(errno) => write!(f, "reading it failed: {}", message(errno)),
            Self::Write(errno) => write!(f, "writing to it failed: {}", message(errno)),
            Self::HungUp => f.write_str("it was hung up"),
            Self::Stuck => f.write_str("it accepted no command for too long"),
            Self::Silent => f.write_str("the device sent nothing for too long"),
            Self::Standstill(ms) => {
                let s = f64::from(ms) * 1e-3;
                write!(
                    f,
                    "hapticd stood still for {s:.1} s, and a device falls silent after 1 s without a command"
                )
            }
            Self::Device(report) => write!(f, "the device reported: {report}"),
        }
    }
}

impl LinkCounters {
    /// Notes a round trip, ns.
    pub fn note_round_trip(&self, round_trip_ns: u64) {
        self.round_trip_ns.store(round_trip_ns, Relaxed);
        self.round_trip_max_ns
            .store(round_trip_ns.max(self.round_trip_max_ns.load(Relaxed)), Relaxed);
        let usual_ns = match self.usual_round_trip_ns.load(Relaxed) {
            0 => round_trip_ns,
            usual_ns => usual_ns - usual_ns / MEAN_OF + round_trip_ns / MEAN_OF,
        };
        self.usual_round_trip_ns.store(usual_ns.max(1), Relaxed);
        let steady_ns = match self.steady_round_trip_ns.load(Relaxed) {
            0 => round_trip_ns,
            steady_ns if round_trip_ns < steady_ns => steady_ns - steady_ns / STEADY_DOWN,
            steady_ns => steady_ns + steady_ns / STEADY_UP,
        };
        self.steady_round_trip_ns.store(steady_ns.max(1), Relaxed);
    }

    /// Notes whether a round trip, ns, is one that force may not have.
    pub fn note_lateness(&self, round_trip_ns: u64, is_late: bool) {
        if is_late {
            self.late_round_trip_ns.store(round_trip_ns, Relaxed);
        }
        let ppm = self.late_ppm.load(Relaxed);
        let news_ppm = if is_late { 1_000_000 / MEAN_OF } else { 0 };
        self.late_ppm.store(ppm - ppm / MEAN_OF + news_ppm, Relaxed);
    }

    /// Notes whether the device confirms commands.
    pub(crate) fn note_ignoring(&self, is_ignoring: bool) {
        self.is_ignoring.store(is_ignoring, Relaxed);
    }

    /// What the device does with the commands of the last moments, whether force flows or not.
    #[must_use]
    pub fn delivery(&self) -> Delivery {
        if self.is_ignoring.load(Relaxed) {
            Delivery::Ignored
        } else if self.late_ppm.load(Relaxed) > MAX_LATE_PPM {
            Delivery::Late
        } else {
            Delivery::InTime
        }
    }

    /// Notes the age of the newest sample in a tick, and the part of it beyond the usual transfer of a
    /// sample, ns.
    pub fn note_age(&self, age_ns: u64, beyond_ns: u64) {
        self.age_ns.store(age_ns, Relaxed);
        let greatest_ns = self.usual_age_ns.load(Relaxed);
        self.usual_age_ns
            .store(beyond_ns.max(greatest_ns - greatest_ns / FORGOTTEN_AFTER), Relaxed);
    }

    /// Notes the number of samples that are missing before a new one.
    pub(crate) fn note_gap(&self, missing: u32) {
        if missing <= MAX_LOST {
            add(&self.lost, u64::from(missing));
        } else {
            add(&self.sequence_jumps, 1);
        }
    }

    /// Notes an error, at a time of ours, ns.
    pub fn note_error(&self, error: LinkError, now_ns: u64) {
        self.last_error.store(error.word(), Relaxed);
        self.last_error_at_ns.store(now_ns, Relaxed);
    }

    /// The last error, and its time on the monotonic clock, ns.
    #[must_use]
    pub fn last_error(&self) -> Option<(LinkError, u64)> {
        let error = LinkError::of_word(self.last_error.load(Relaxed))?;
        Some((error, self.last_error_at_ns.load(Relaxed)))
    }

    /// Notes that a device is asked who it is, from a time of ours, ns, until the guard is dropped.
    #[must_use]
    pub fn ask(&self, now_ns: u64) -> AskGuard<'_> {
        self.asking_since_ns.store(now_ns.max(1), Relaxed);
        AskGuard(self)
    }

    /// Time on the monotonic clock since which a device is asked who it is, ns.
    #[must_use]
    pub fn asking_since_ns(&self) -> Option<u64> {
        Some(self.asking_since_ns.load(Relaxed)).filter(|since_ns| *since_ns > 0)
    }

    /// Forgets the measurements of one conversation: the next may be with another device.
    pub fn begin_conversation(&self) {
        self.drift_ppb.store(UNKNOWN_DRIFT, Relaxed);
        self.usual_round_trip_ns.store(0, Relaxed);
        self.steady_round_trip_ns.store(0, Relaxed);
        self.period_ns.store(0, Relaxed);
        self.usual_age_ns.store(0, Relaxed);
        self.late_round_trip_ns.store(0, Relaxed);
        self.late_ppm.store(0, Relaxed);
        self.is_ignoring.store(false, Relaxed);
        add(&self.connections, 1);
    }
}

/// The guard of [`LinkCounters::ask`]: while it lives, a device is asked who it is.
#[derive(Debug)]
pub struct AskGuard<'a>(&'a LinkCounters);

impl Drop for AskGuard<'_> {
    fn drop(&mut self) {
        self.0.asking_since_ns.store(0, Relaxed);
    }
}

/// Most samples that can be missing at once: those of half a second, after which the device counts
/// as gone, at the highest rate of the protocol.
const MAX_LOST: u32 = 50_000;

/// Parts by which the steady round trip goes down for a quicker one, and up for another: it rests where there are three
/// of those for one of these.
const STEADY_DOWN: u64 = 16;
const STEADY_UP: u64 = 48;

/// Number of round trips in their mean.
const MEAN_OF: u64 = 128;

/// Most round trips that may be late before nobody may engage, parts in 1e6: a line that carries too little has a sixth
/// of them late or more, and one hiccup of a machine a hundredth.
const MAX_LATE_PPM: u64 = 50_000;

/// Ticks after which a largest age has decayed to a third.
const FORGOTTEN_AFTER: u64 = 1024;

/// Value of `drift_ppb` while the drift is not known.
pub const UNKNOWN_DRIFT: i64 = i64::MIN;

/// Adds to a counter whose only writer is the caller: without a read-modify-write, which is a loop
/// on some processors.
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
            LinkError::Standstill(u32::MAX),
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
