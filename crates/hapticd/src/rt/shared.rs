//! The words that the control thread and the real-time thread share: what must not wait behind a full ring. Each is
//! written by one side and read by the other in one instruction.
//!
//! A scheduled change has a word too, which leaves [`ClaimState::Open`] once: the loop renders the change in its tick,
//! or the control thread takes it back. Whichever thread moves the word first has decided, and the other reads what
//! it decided: a change is either rendered or taken back, never both and never neither.

use super::atomic::{AtomicBool, AtomicU64, Ordering};

#[derive(Debug)]
pub(crate) struct Shared {
    /// Stops asked for so far.
    stops: AtomicU64,
    quit: AtomicBool,
    /// Serial number of the newest command that nobody waits for any more.
    withdrawn: AtomicU64,
    /// When the first lease lapses, ns on the monotonic clock; never, where it is the largest number.
    lease_until_ns: AtomicU64,
    /// When the control thread last gave a sign of life, ns on the monotonic clock; the largest
    /// number before it has begun to.
    heartbeat_ns: AtomicU64,
}

impl Shared {
    pub(crate) fn new() -> Self {
        Self {
            stops: AtomicU64::new(0),
            quit: AtomicBool::new(false),
            withdrawn: AtomicU64::new(0),
            lease_until_ns: AtomicU64::new(u64::MAX),
            heartbeat_ns: AtomicU64::new(u64::MAX),
        }
    }

    /// Sets when the rig is released unless that time is postponed.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.lease_until_ns.store(until_ns, Ordering::Release);
    }

    /// Whether a lease has lapsed.
    pub(crate) fn has_lapsed(&self, now_ns: u64) -> bool {
        now_ns > self.lease_until_ns.load(Ordering::Acquire)
    }

    /// The control thread's sign of life: it hears stops at this time.
    pub(crate) fn heartbeat(&self, now_ns: u64) {
        self.heartbeat_ns.store(now_ns, Ordering::Release);
    }

    /// For how long the control thread has given no sign of life, ns.
    pub(crate) fn silent_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.heartbeat_ns.load(Ordering::Acquire))
    }

    /// Asks for zero force at once; returns the number that this stop has.
    pub(crate) fn stop(&self) -> u64 {
        self.stops.fetch_add(1, Ordering::AcqRel) + 1
    }

    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.stops.load(Ordering::Acquire)
    }

    /// Asks the loop to end.
    pub(crate) fn quit(&self) {
        self.quit.store(true, Ordering::Release);
    }

    /// Whether the loop shall end.
    pub(crate) fn quitting(&self) -> bool {
        self.quit.load(Ordering::Acquire)
    }

    /// Takes the command with this serial number back, and all before it. The real-time thread may be carrying it
    /// out at this moment; once that is done it can be seen in the answers.
    pub(crate) fn withdraw(&self, serial: u64) {
        self.withdrawn.store(serial, Ordering::Release);
    }

    /// Whether the command with this serial number was taken back.
    pub(crate) fn is_withdrawn(&self, serial: u64) -> bool {
        serial <= self.withdrawn.load(Ordering::Acquire)
    }
}

/// What became of a scheduled change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClaimState {
    /// It waits for its tick.
    Open,
    /// The control thread has taken it back.
    Withdrawn,
    /// The loop has discarded it, because the rig was stopped, faulted or disconnected.
    Halted,
    /// The loop has discarded it, because it came after its tick.
    Missed,
    /// The loop has rendered it from this tick on.
    Rendered(u64),
}

/// Codes below the first of a rendered change.
const FIRST_TICK: u64 = 4;

impl ClaimState {
    fn pack(self) -> u64 {
        match self {
            Self::Open => 0,
            Self::Withdrawn => 1,
            Self::Halted => 2,
            Self::Missed => 3,
            Self::Rendered(tick) => tick + FIRST_TICK,
        }
    }

    fn unpack(word: u64) -> Self {
        match word {
            0 => Self::Open,
            1 => Self::Withdrawn,
            2 => Self::Halted,
            3 => Self::Missed,
            tick => Self::Rendered(tick - FIRST_TICK),
        }
    }
}

/// The word of one scheduled change.
#[derive(Debug)]
pub(crate) struct Claim(AtomicU64);

impl Claim {
    pub(crate) fn new() -> Self {
        Self(AtomicU64::new(ClaimState::Open.pack()))
    }

    /// Decides, if nobody has decided yet; returns whether this call did.
    pub(crate) fn decide(&self, state: ClaimState) -> bool {
        self.0
            .compare_exchange(
                ClaimState::Open.pack(),
                state.pack(),
                Ordering::AcqRel,
                Ordering::Acquire,
            )
            .is_ok()
    }

    /// What was decided so far.
    pub(crate) fn state(&self) -> ClaimState {
        ClaimState::unpack(self.0.load(Ordering::Acquire))
    }
}
