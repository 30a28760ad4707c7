//! A slide against friction that falls with speed (Stribeck's curve): no oscillator, but near one
//! for a while.
//!
//! Each piece takes the curve's tangent at its start into the oscillator's damping, which makes the
//! piece an exact solution of the linearised equation; what the curve really did at the end of it
//! is then put in as a force that grows with the square of time (the exponential Rosenbrock method
//! of third order of Hochbruck, Ostermann and Schweitzer 2009). That correction is also the measure
//! of the error: a piece with too large a one is halved.

use super::fall::{FallLevel, SlideEnd, first_fall};
use super::oscillator::{Motion, Oscillator};
use super::piece_length::{LONGEST, next_length};
use super::slide::{PieceEnd, Slide};
use crate::contact::stribeck;

/// One direction of sliding under Stribeck's curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StribeckSlide {
    mass: f64,
    stiffness: f64,
    /// `B + b`.
    damping: f64,
    coupling_damping: f64,
    static_force: f64,
    dynamic_force: f64,
    velocity: f64,
    /// Where the curve begins: the limit at which this slide let go.
    peak: f64,
    /// The correction, N in the coupling, up to which a piece is accepted.
    tolerance: f64,
    /// Length of the piece to try next, s.
    try_s: f64,
}

/// Corrections up to this share of the limit are accepted.
const TOLERANCE: f64 = 1e-6;

/// Parameters of a slide in one direction.
pub(crate) struct StribeckParts {
    pub(crate) mass: f64,
    pub(crate) stiffness: f64,
    pub(crate) coupling_damping: f64,
    pub(crate) viscous: f64,
    pub(crate) static_force: f64,
    pub(crate) dynamic_force: f64,
    pub(crate) velocity: f64,
}

impl StribeckSlide {
    pub(crate) fn new(parts: &StribeckParts) -> Self {
        Self {
            mass: parts.mass,
            stiffness: parts.stiffness,
            damping: parts.coupling_damping + parts.viscous,
            coupling_damping: parts.coupling_damping,
            static_force: parts.static_force,
            dynamic_force: parts.dynamic_force,
            velocity: parts.velocity,
            peak: parts.static_force,
            tolerance: TOLERANCE * parts.static_force.max(parts.dynamic_force),
            try_s: f64::INFINITY,
        }
    }

    fn curve(&self, speed: f64) -> (f64, f64) {
        stribeck(self.peak, self.dynamic_force, self.velocity, speed)
    }
}

impl Slide for StribeckSlide {
    const EXTRA_WORK: u32 = 160;

    fn static_force(&self) -> f64 {
        self.static_force
    }

    fn dynamic_force(&self) -> f64 {
        self.dynamic_force
    }

    fn friction_at(&self, speed: f64) -> f64 {
        self.curve(speed).0
    }

    fn damping(&self) -> f64 {
        self.damping
    }

    fn half_turns(&self, time_s: f64) -> f64 {
        Oscillator::new(self.mass, 0.0, self.stiffness).half_turns(time_s)
    }

    fn set_off(&mut self, limit: f64) {
        self.peak = limit;
        self.try_s = f64::INFINITY;
    }

    fn steady(&mut self, _motion: &Motion, _elapsed_s: f64, _level: FallLevel) -> Option<(f64, f64)> {
        None
    }

    fn piece(&mut self, motion: &Motion, remaining_s: f64, level: FallLevel, most_extrema: u32) -> (PieceEnd, u32) {
        let (at_zero, w0) = (self.curve(0.0).0, motion.w0);
        let (friction, slope) = self.curve(w0);
        let damping = self.damping + slope;
        let oscillator = Oscillator::new(self.mass, damping, self.stiffness);
        let linear = Motion {
            w0,
            // `motion` has the friction at no speed taken off.
            f0: motion.f0 + at_zero - (friction - slope * w0),
            g1: motion.g1,
        };
        let mut work = 0;
        let mut length = self.try_s.min(remaining_s);
        if damping < 0.0 {
            length = length.min(LONGEST * oscillator.shortest_time());
        }
        loop {
            work += 1;
            let (end, extrema) = first_fall(&oscillator, &linear, length, level, most_extrema);
            work += extrema;
            let (lasted_s, falls, armed) = match end {
                SlideEnd::None { armed } => (length, false, armed),
                SlideEnd::Falls { at, armed } => (at, true, armed),
                SlideEnd::Exhausted => return (PieceEnd::Exhausted, work),
            };
            let r = oscillator.response(lasted_s);
            let (y, w) = oscillator.advance(&linear, &r);
            let end_friction = self.curve(w.max(0.0)).0;
            let missed = end_friction - (friction + slope * (w - w0));
            let (dy, dw) = oscillator.late_force(-missed, lasted_s, &r);
            let error = (self.stiffness * (dy.abs() + dw.abs() * lasted_s)).max(self.coupling_damping * dw.abs());
            let next = next_length(lasted_s, error, self.tolerance);
            if error > self.tolerance && work < most_extrema && lasted_s > 0.0 {
                length = next;
                continue;
            }
            // A piece that was cut short by an event says nothing against longer ones.
            if next < self.try_s || lasted_s >= self.try_s.min(remaining_s) {
                self.try_s = next;
            }
            let moved = (y + dy).max(0.0);
            let friction = 0.5 * (friction + end_friction);
            let end = if falls {
                PieceEnd::Falls {
                    at_s: lasted_s,
                    moved,
                    armed,
                    friction,
                }
            } else {
                PieceEnd::Lasts {
                    lasted_s,
                    moved,
                    speed: (w + dw).max(0.0),
                    armed,
                    friction,
                }
            };
            return (end, work);
        }
    }
}
