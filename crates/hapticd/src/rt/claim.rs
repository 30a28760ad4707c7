//! Who decides on a scheduled change: the loop that renders it in its tick, or the control thread that
//! takes it back.
//!
//! One word, which leaves [`ClaimState::Open`] once. Whichever thread moves it first has decided, and the
//! other reads what it decided: a change is either rendered or taken back, never both and never
//! neither.

use super::atomic::{AtomicU64, Ordering};

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
