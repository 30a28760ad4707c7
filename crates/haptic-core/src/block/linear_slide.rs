//! A slide against constant and viscous friction, in closed form.

use super::fall::{FallLevel, SlideEnd, first_fall, passes};
use super::oscillator::{Motion, Oscillator};
use super::propagator::Propagator;
use super::slide::{PieceEnd, Slide, SlideBounds};
use crate::directional::Direction;
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

    fn set_off(&mut self, _limit: f64) {}

    #[inline(always)]
    fn steady(&mut self, motion: &Motion, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)> {
        let r = self.propagator.at(&self.oscillator, elapsed_s);
        let (y, w) = passes(&self.oscillator, motion, &r, elapsed_s, level)?;
        Some((y.max(0.0), w))
    }

    fn piece(&mut self, motion: &Motion, bounds: &SlideBounds) -> (PieceEnd, u32) {
        let oscillator = &self.oscillator;
        let SlideBounds {
            remaining_s,
            level,
            most_work,
            ..
        } = *bounds;
        let (end, extrema) = first_fall(oscillator, motion, remaining_s, level, most_work);
        let end = match end {
            SlideEnd::None { armed } => {
                let (y, w) = oscillator.advance(motion, &oscillator.response(remaining_s));
                let moved = y.max(0.0);
                PieceEnd::Lasts {
                    lasted_s: remaining_s,
                    moved,
                    // Rounding may leave a hair of backward motion at the end of the interval.
                    speed: w.max(0.0),
                    armed,
                    dissipated: self.dynamic_force * moved,
                }
            }
            SlideEnd::Falls { at, armed } => {
                let moved = oscillator.advance(motion, &oscillator.response(at)).0.max(0.0);
                PieceEnd::Falls {
                    at_s: at,
                    moved,
                    armed,
                    dissipated: self.dynamic_force * moved,
                }
            }
            SlideEnd::Exhausted => PieceEnd::Exhausted,
        };
        (end, extrema)
    }
}
