//! Whether a body sticks or slides, and what its contact remembers.

use super::level::Level;
use crate::directional::Direction;
use crate::flush::flush;
use crate::snapshot::Archive;
use core::fmt::Debug;

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

    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        const ALL: [Contact; 3] = [
            Contact::Stuck,
            Contact::Sliding(Direction::Positive),
            Contact::Sliding(Direction::Negative),
        ];
        archive.choice("contact", self, &ALL);
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

    /// As much of its force, N, as limits by direction hold.
    pub(crate) fn held(&self, limit: impl Fn(Direction) -> f64) -> f64 {
        let force = if self.force.is_finite() { self.force } else { 0.0 };
        flush(force.clamp(-limit(Direction::Negative), limit(Direction::Positive)))
    }

    /// A slide on a level of friction, whose static limit after a long rest is `rested`, N.
    pub(crate) fn sliding(level: &impl Level, direction: Direction, rested: f64) -> Self {
        let began = level.set_off_at(direction).unwrap_or(rested);
        Self {
            slide: Some(direction),
            set_off: Self::share_of(began, rested, level.kinetic(direction)),
            ..Self::RESTED
        }
    }

    /// Has a level of friction go on with its slide in a direction.
    pub(crate) fn set_off(&self, level: &mut impl Level, direction: Direction, rested: f64) {
        let limit = self.set_off_limit(rested, level.kinetic(direction));
        level.set_off(direction, limit);
    }

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

/// The contact of a law, as it is between two motions.
pub(crate) trait LawContact: Clone + Debug + Send + Sync + 'static {
    /// Friction at rest, N, signed: it balances a load of the same sign and size.
    fn force_at_rest(&self) -> f64;

    /// Goes on from what a contact remembers, at a speed, m/s; of a force it takes as much as it can
    /// hold.
    fn recall(&mut self, memory: &ContactMemory, speed: f64);

    /// What it remembers.
    fn memory(&self) -> ContactMemory {
        ContactMemory {
            force: self.force_at_rest(),
            ..ContactMemory::RESTED
        }
    }

    /// Saves or loads what it goes by.
    fn archive(&mut self, archive: &mut Archive<'_>);

    /// How it counts in a motion: stuck where more than half of it is taken up by deflection.
    fn contact(&self, direction: Direction, speed: f64) -> Contact;

    /// The same at a velocity, m/s; at rest, for the direction in which it is loaded.
    fn contact_at(&self, velocity: f64) -> Contact {
        let direction = if velocity == 0.0 {
            self.facing()
        } else {
            Direction::of(velocity)
        };
        self.contact(direction, velocity.abs())
    }

    /// The direction in which it is loaded, or of its slide.
    fn facing(&self) -> Direction {
        Direction::of(self.force_at_rest())
    }
}
