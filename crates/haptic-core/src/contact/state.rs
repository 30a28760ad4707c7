//! Whether a body sticks or slides, and what its contact remembers.
//!
//! Its static limit is a function of the time at rest.

use super::level::Level;
use crate::directional::Direction;
use crate::math::{exp, exp_m1, flush, ln_1p};
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

/// The static limit of a contact at rest. Limits are given for one direction: what the contact
/// comes to hold after a long rest, and what it holds just after a slide. By default it keeps no time at rest.
pub(crate) trait StaticLimit: Clone + Copy + Debug + Send + Sync + 'static {
    /// The limit after some more rest, N.
    fn after(&self, rested: f64, fresh: f64, wait_s: f64) -> f64;

    /// The limit now, N.
    fn now(&self, rested: f64, fresh: f64) -> f64 {
        self.after(rested, fresh, 0.0)
    }

    /// Seconds until a force of `force` N that grows by `slope` N/s (> 0) reaches the limit.
    fn delay(&self, rested: f64, fresh: f64, force: f64, slope: f64) -> f64;

    /// The contact rests on.
    fn rest(&mut self, _elapsed_s: f64) {}

    /// The contact begins to rest again.
    fn begin(&mut self, _dwell_s: f64) {}

    /// The contact begins to rest again with a limit, or as near to it as it can.
    fn begin_at(&mut self, _rested: f64, _fresh: f64, _limit: f64) {}

    /// For how long it has rested, s; infinite where that is not kept.
    fn dwell_s(&self) -> f64 {
        f64::INFINITY
    }

    /// Saves or loads that.
    fn archive(&mut self, _archive: &mut Archive<'_>) {}
}

/// The whole limit is there at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConstantLimit;

impl StaticLimit for ConstantLimit {
    fn after(&self, rested: f64, _fresh: f64, _wait_s: f64) -> f64 {
        rested
    }

    fn delay(&self, rested: f64, _fresh: f64, force: f64, slope: f64) -> f64 {
        ((rested - force) / slope).max(0.0)
    }
}

/// `Fs(td) = Fd + (Fs_inf - Fd)(1 - e^(-gamma td))` (Kato, Sato and Matsubayashi 1972, with their
/// exponent m = 1).
#[derive(Clone, Copy, Debug)]
pub(crate) struct RisingLimit {
    rate: f64,
    dwell_s: f64,
}

impl RisingLimit {
    /// `rate` is `gamma`, 1/s.
    pub(crate) fn new(rate: f64) -> Self {
        Self { rate, dwell_s: 0.0 }
    }
}

impl StaticLimit for RisingLimit {
    fn after(&self, rested: f64, fresh: f64, wait_s: f64) -> f64 {
        if rested <= fresh {
            return rested;
        }
        fresh - (rested - fresh) * exp_m1(-self.rate * (self.dwell_s + wait_s))
    }

    /// Newton's method from the right: force less limit is convex and not negative there, so that
    /// each step ends right of the first root again, and nearer.
    fn delay(&self, rested: f64, fresh: f64, force: f64, slope: f64) -> f64 {
        let mut wait = ((rested - force) / slope).max(0.0);
        if rested <= fresh {
            return wait;
        }
        for _ in 0..64 {
            let left = (rested - fresh) * flush(exp(-self.rate * (self.dwell_s + wait)));
            let beyond = force + slope * wait - (rested - left);
            let next = wait - beyond / (slope - self.rate * left);
            if next < wait {
                wait = next;
            } else {
                // Rounding ends the descent, and so does a slope of zero where the two only touch.
                break;
            }
        }
        wait.max(0.0)
    }

    fn rest(&mut self, elapsed_s: f64) {
        self.dwell_s += elapsed_s;
    }

    fn begin(&mut self, dwell_s: f64) {
        self.dwell_s = dwell_s;
    }

    fn begin_at(&mut self, rested: f64, fresh: f64, limit: f64) {
        self.dwell_s = if limit <= fresh {
            0.0
        } else if limit >= rested {
            f64::INFINITY
        } else {
            -ln_1p(-(limit - fresh) / (rested - fresh)) / self.rate
        };
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("rest_s", &mut self.dwell_s);
    }

    fn dwell_s(&self) -> f64 {
        self.dwell_s
    }
}
