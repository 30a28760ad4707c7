//! A slide in one direction between two events, under a law that makes it an oscillator.

use super::fall::{FallLevel, SlideEnd, first_fall, passes};
use super::oscillator::{Motion, Oscillator, Response};
use crate::parameters::Direction;
use core::fmt::Debug;

/// What becomes of a slide within an interval, in the coordinate in which it goes forwards.
pub(crate) enum PieceEnd {
    /// It went on for a time; whether it is armed at the end, and the friction that it met on the way, N.
    Lasts {
        lasted_s: f64,
        moved: f64,
        speed: f64,
        armed: bool,
        friction: f64,
    },
    /// It fell to the velocity at which it ends.
    Falls {
        at_s: f64,
        moved: f64,
        armed: bool,
        friction: f64,
    },
    /// The search met more extrema than a tick may work through.
    Exhausted,
}

/// One direction of sliding, compiled.
pub(crate) trait Slide: Clone + Debug + Send + Sync + 'static {
    /// Work that a tick may do for it beside that of its events.
    const EXTRA_WORK: u32;

    /// What a contact that has rested holds, N.
    fn static_force(&self) -> f64;
    /// Friction of a fast slide without its viscous part, N.
    fn dynamic_force(&self) -> f64;
    /// The same at a speed, m/s.
    fn friction_at(&self, speed: f64) -> f64;
    /// Total damping `B + b`, N s/m.
    fn damping(&self) -> f64;
    /// Half-turns of the free oscillation in a time.
    fn half_turns(&self, time_s: f64) -> f64;
    /// The contact lets go at a limit, N.
    fn set_off(&mut self, limit: f64);

    /// A whole tick of sliding, where it is sure that nothing happens in it: displacement and speed at its end.
    ///
    /// `motion.f0` is the force on the block at rest, less the friction at no speed.
    fn steady(&mut self, motion: &Motion, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)>;

    /// The next piece of a slide, and the extrema looked at for it.
    fn piece(&mut self, motion: &Motion, remaining_s: f64, level: FallLevel, most_extrema: u32) -> (PieceEnd, u32);
}

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
    /// `static_force` is what the contact holds; `damping` is `B + b`.
    pub(super) fn new(mass: f64, damping: f64, stiffness: f64, static_force: f64, dynamic_force: f64) -> Self {
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

/// The response for the tick length met last: a steady tick finds it here.
#[derive(Clone, Copy, Debug)]
pub(super) struct Propagator {
    cached_for: f64,
    cached: Response,
}

impl Propagator {
    pub(super) fn new(oscillator: &Oscillator) -> Self {
        Self {
            cached_for: 0.0,
            cached: oscillator.response(0.0),
        }
    }

    /// The response at `t`: the one kept where the tick is as long as the last, one derived from it where it nearly is.
    pub(super) fn at(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        #[expect(clippy::float_cmp, reason = "a cache key: the same number or not")]
        if t == self.cached_for {
            return self.cached;
        }
        if let Some(nearby) = oscillator.response_near(&self.cached, t - self.cached_for) {
            return nearby;
        }
        self.cached = oscillator.response(t);
        self.cached_for = t;
        self.cached
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

    fn set_off(&mut self, _limit: f64) {}

    fn steady(&mut self, motion: &Motion, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)> {
        let r = self.propagator.at(&self.oscillator, elapsed_s);
        let (y, w) = passes(&self.oscillator, motion, &r, elapsed_s, level)?;
        Some((y.max(0.0), w))
    }

    fn piece(&mut self, motion: &Motion, remaining_s: f64, level: FallLevel, most_extrema: u32) -> (PieceEnd, u32) {
        let oscillator = &self.oscillator;
        let (end, extrema) = first_fall(oscillator, motion, remaining_s, level, most_extrema);
        let end = match end {
            SlideEnd::None { armed } => {
                let (y, w) = oscillator.advance(motion, &oscillator.response(remaining_s));
                PieceEnd::Lasts {
                    lasted_s: remaining_s,
                    moved: y.max(0.0),
                    // Rounding may leave a hair of backward motion at the end of the interval.
                    speed: w.max(0.0),
                    armed,
                    friction: self.dynamic_force,
                }
            }
            SlideEnd::Falls { at, armed } => PieceEnd::Falls {
                at_s: at,
                moved: oscillator.advance(motion, &oscillator.response(at)).0.max(0.0),
                armed,
                friction: self.dynamic_force,
            },
            SlideEnd::Exhausted => PieceEnd::Exhausted,
        };
        (end, extrema)
    }
}

/// The slides of both directions.
pub(crate) trait Sides: Clone + Debug + Send + Sync + 'static {
    type Slide: Slide;
    fn get(&self, direction: Direction) -> &Self::Slide;
    fn get_mut(&mut self, direction: Direction) -> &mut Self::Slide;
}

/// A surface that is the same either way: one slide, and no question which.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Same<S>(pub(super) S);

impl<S: Slide> Sides for Same<S> {
    type Slide = S;

    fn get(&self, _direction: Direction) -> &S {
        &self.0
    }

    fn get_mut(&mut self, _direction: Direction) -> &mut S {
        &mut self.0
    }
}

/// A surface that differs by direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Each<S> {
    pub(super) positive: S,
    pub(super) negative: S,
}

impl<S: Slide> Sides for Each<S> {
    type Slide = S;

    fn get(&self, direction: Direction) -> &S {
        match direction {
            Direction::Positive => &self.positive,
            Direction::Negative => &self.negative,
        }
    }

    fn get_mut(&mut self, direction: Direction) -> &mut S {
        match direction {
            Direction::Positive => &mut self.positive,
            Direction::Negative => &mut self.negative,
        }
    }
}
