//! Whether a body sticks or slides, and what its contact remembers.

use crate::direction::Direction;

/// How the block touches the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// At rest; friction holds it.
    Stuck,
    /// Sliding in a direction.
    Sliding(Direction),
}

impl Contact {
    /// `0` stuck, `+1` and `-1` sliding: the number used in files and on the wire.
    #[must_use]
    pub const fn as_number(self) -> i8 {
        match self {
            Self::Stuck => 0,
            Self::Sliding(Direction::Positive) => 1,
            Self::Sliding(Direction::Negative) => -1,
        }
    }
}

/// What a contact goes by from one tick to the next, in the same words whatever its law: so one takes
/// over from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactMemory {
    /// The force that it holds at rest by its deflection or with its slide, N, signed.
    pub force: f64,
    /// The direction of its slide, where its law has one that begins and ends; `None` while it holds.
    pub slide: Option<Direction>,
    /// The share of `Fs - Fd` with which that slide set off: below 1 after a short rest under a rising
    /// limit.
    pub set_off: f64,
    /// For how long it has rested, s, where the static limit depends on it; infinite where it does
    /// not.
    pub dwell_s: f64,
}

impl ContactMemory {
    /// Without force, after a long rest.
    pub const RESTED: Self = Self {
        force: 0.0,
        slide: None,
        set_off: 1.0,
        dwell_s: f64::INFINITY,
    };

    /// The share for a slide that set off at `limit`, between the limits of a fresh and of a rested
    /// contact, N.
    pub(crate) fn share_of(limit: f64, rested: f64, fresh: f64) -> f64 {
        let (above, most) = (limit - fresh, rested - fresh);
        if above == most { 1.0 } else { above / most }
    }

    /// The limit for its share, N.
    pub(crate) fn set_off_limit(&self, rested: f64, fresh: f64) -> f64 {
        if self.set_off == 1.0 {
            rested
        } else {
            fresh + self.set_off * (rested - fresh)
        }
    }
}
