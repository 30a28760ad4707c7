//! A slide against constant and viscous friction, in closed form.
//!
//! When it falls to the velocity at which it ends: the velocity's extrema are closed-form; between
//! them it is monotone, so the first one at or below the level brackets the fall, and a safeguarded
//! Newton iteration finds it.

use super::course::Course;
use super::exact::{Slide, SlidePiece};
use super::expansion::Piece;
use super::oscillator::{InitialState, Oscillator, Propagator};
use crate::block::oscillator::Response;
use crate::directional::Direction;
use crate::series::falls_between;
use crate::snapshot::Archive;

/// A slide against constant and viscous friction: solved exactly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearSlide {
    oscillator: Oscillator,
    damping: f64,
    static_force: f64,
    dynamic_force: f64,
    propagator: Propagator,
}

impl LinearSlide {
    /// `static_force` is the static limit, N; `damping` is `B + b`, N s/m.
    pub(crate) fn new(mass: f64, damping: f64, stiffness: f64, static_force: f64, dynamic_force: f64) -> Self {
        let oscillator = Oscillator::new(mass, damping, stiffness);
        Self {
            oscillator,
            damping,
            static_force,
            dynamic_force,
            propagator: Propagator::new(&oscillator),
        }
    }
}

impl Slide for LinearSlide {
    const EXTRA_WORK: u32 = 0;

    fn static_force(&self) -> f64 {
        self.static_force
    }

    fn dynamic_force(&self) -> f64 {
        self.dynamic_force
    }

    fn friction_at(&self, _speed: f64) -> f64 {
        self.dynamic_force
    }

    fn damping(&self) -> f64 {
        self.damping
    }

    fn half_turns(&self, time_s: f64) -> f64 {
        self.oscillator.half_turns(time_s)
    }

    fn rest(&mut self) {
        self.propagator.rest(&self.oscillator);
    }

    fn archive(&mut self, direction: Direction, archive: &mut Archive<'_>) {
        let name = match direction {
            Direction::Positive => "tick_to_positive_s",
            Direction::Negative => "tick_to_negative_s",
        };
        self.propagator.archive(name, &self.oscillator, archive);
    }

    #[inline(always)]
    fn steady(&mut self, motion: &InitialState, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)> {
        let r = self.propagator.at(&self.oscillator, elapsed_s);
        let (y, w) = passes(&self.oscillator, motion, &r, elapsed_s, level)?;
        Some((y.max(0.0), w))
    }

    fn piece(
        &mut self,
        motion: &InitialState,
        level: FallLevel,
        course: &Course,
        _listens: bool,
    ) -> Option<SlidePiece> {
        let oscillator = &self.oscillator;
        let (remaining_s, most_work) = (course.remaining(), course.budget - course.work);
        let (end, extrema) = first_fall(oscillator, motion, remaining_s, level, most_work);
        let (lasted_s, armed, falls) = match end {
            SlideEnd::None { armed } => (remaining_s, armed, false),
            SlideEnd::Falls { at, armed } => (at, armed, true),
            SlideEnd::Exhausted => return None,
        };
        let (y, w) = oscillator.advance(motion, &oscillator.response(lasted_s));
        let distance = y.max(0.0);
        let piece = Piece {
            lasted_s,
            distance,
            // Rounding may leave a hair of backward motion at the end of the interval.
            speed: w.max(0.0),
            dissipated: self.dynamic_force * distance,
            work: extrema,
        };
        Some(SlidePiece { piece, armed, falls })
    }
}

/// How a slide ends, or that it does not.
pub(super) enum SlideEnd {
    /// It continues to the end of the interval; whether it is armed there.
    None { armed: bool },
    /// The velocity falls to the re-stick level at this time.
    Falls { at: f64, armed: bool },
    /// The search met more extrema than a tick may work through.
    Exhausted,
}

/// The velocity at which a slide ends: a threshold once it has been faster, and zero until then.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FallLevel {
    pub(super) armed: bool,
    pub(super) threshold: f64,
}

impl FallLevel {
    /// m/s.
    pub(super) fn speed(self) -> f64 {
        if self.armed { self.threshold } else { 0.0 }
    }
}

/// Whether it is sure, without a search, that a forward slide does not fall to its re-stick level
/// in a time whose response is `r`: displacement and speed at its end are then returned.
pub(super) fn passes(
    oscillator: &Oscillator,
    motion: &InitialState,
    r: &Response,
    time_s: f64,
    level: FallLevel,
) -> Option<(f64, f64)> {
    let FallLevel { armed, threshold } = level;
    if r.h == 0.0 {
        // The free motion has died out, and its signs with it: what it did before is to be searched for.
        return None;
    }
    let (y, w) = oscillator.advance(motion, r);
    let (a0, beta) = oscillator.acceleration(motion);
    let a = a0 * r.dh + beta * r.h;
    if !(w > level.speed() && oscillator.turns_once_at_most(time_s)) {
        return None;
    }
    let sure = if a0 < 0.0 {
        let dips = a > 0.0;
        motion.w0 > 0.0 && !dips
    } else {
        // A peak inside could arm the slide and be fallen from.
        let may_arm_unseen = threshold > 0.0 && !armed && a0 > 0.0 && a < 0.0;
        // At exactly zero velocity and acceleration the direction is for the full search to decide.
        (motion.w0 > 0.0 || a0 > 0.0) && !may_arm_unseen
    };
    sure.then_some((y, w))
}

/// The first time in `(0, remaining]` at which a forward slide falls to its re-stick level, and the
/// number of velocity extrema looked at to find it.
pub(super) fn first_fall(
    oscillator: &Oscillator,
    motion: &InitialState,
    remaining: f64,
    level: FallLevel,
    most_extrema: u32,
) -> (SlideEnd, u32) {
    let FallLevel { mut armed, threshold } = level;
    if motion.w0 == 0.0 && oscillator.acceleration(motion) == (0.0, 0.0) {
        // At rest and without load: nothing falls.
        return (SlideEnd::None { armed }, 0);
    }
    let (mut extremum, distance) = oscillator.extrema(motion);
    let mut extrema = 0;
    let mut from = 0.0;
    let mut w_from = motion.w0;
    loop {
        let to = extremum.min(remaining);
        let (w_to, _) = oscillator.velocity(motion, to);
        if w_to > w_from {
            armed = armed || w_to > threshold;
        } else {
            let level = if armed { threshold } else { 0.0 };
            if w_to <= level && w_from >= level {
                // Touching the end of the interval from above is for the next tick to see.
                let at = falls_between((from, to), 0.5 * (from + to), 1e-14 * remaining, |at| {
                    let (w, a) = oscillator.velocity(motion, at);
                    (w - level, a)
                });
                return (SlideEnd::Falls { at, armed }, extrema);
            }
        }
        if to >= remaining {
            return (SlideEnd::None { armed }, extrema);
        }
        if extrema >= most_extrema {
            return (SlideEnd::Exhausted, extrema);
        }
        extrema += 1;
        from = to;
        w_from = w_to;
        extremum += distance;
    }
}
