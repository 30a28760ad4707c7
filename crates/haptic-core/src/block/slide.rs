//! A slide in one direction between two events.

use super::fall::FallLevel;
use super::oscillator::Motion;
use crate::directional::Direction;
use crate::snapshot::Archive;
use core::fmt::Debug;

/// End of a piece of a slide, in the coordinate in which it goes forwards.
pub(crate) enum PieceEnd {
    /// It went on for a time; whether it is armed at the end, and the energy that its friction took,
    /// J, its viscous part left out.
    Lasts {
        lasted_s: f64,
        moved: f64,
        speed: f64,
        armed: bool,
        dissipated: f64,
    },
    /// It fell to the velocity at which it ends.
    Falls {
        at_s: f64,
        moved: f64,
        armed: bool,
        dissipated: f64,
    },
    /// The search met more extrema than a tick may work through.
    Exhausted,
}

/// Limits of a piece.
pub(crate) struct SlideBounds {
    /// Time to the end of the tick, s.
    pub(crate) remaining_s: f64,
    pub(crate) level: FallLevel,
    /// Work that it may take.
    pub(crate) most_work: u32,
    /// Whether a listener wants the energy.
    pub(crate) listens: bool,
}

/// One direction of sliding, compiled.
pub(crate) trait Slide: Clone + Debug + Send + Sync + 'static {
    /// Work that a tick may do for it beside that of its events.
    const EXTRA_WORK: u32;

    /// Static limit after a long rest, N.
    fn static_force(&self) -> f64;
    /// Friction of a fast slide without its viscous part, N.
    fn dynamic_force(&self) -> f64;
    /// The same at a speed, m/s.
    fn friction_at(&self, speed: f64) -> f64;
    /// Total damping `B + b`, N s/m.
    fn damping(&self) -> f64;
    /// Half-turns of the free oscillation in a time.
    fn half_turns(&self, time_s: f64) -> f64;
    /// Forgets the ticks before.
    fn rest(&mut self);
    /// Saves or loads what it keeps from tick to tick, under names that end in a direction.
    fn archive(&mut self, direction: Direction, archive: &mut Archive<'_>);
    /// The contact lets go at a limit, N.
    fn set_off(&mut self, limit: f64);
    /// The limit at which it did, N, where that matters to the slide.
    fn peak(&self) -> f64 {
        self.static_force()
    }

    /// A whole tick of sliding, where it is sure that nothing happens in it: displacement and speed
    /// at its end.
    ///
    /// `motion.f0` is the force on the block at rest, less the friction at no speed.
    fn steady(&mut self, motion: &Motion, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)>;

    /// The next piece of a slide, and the work that it took.
    fn piece(&mut self, motion: &Motion, bounds: &SlideBounds) -> (PieceEnd, u32);
}

/// The slides of both directions.
pub(crate) trait Sides: Clone + Debug + Send + Sync + 'static {
    type Slide: Slide;
    fn get(&self, direction: Direction) -> &Self::Slide;
    fn get_mut(&mut self, direction: Direction) -> &mut Self::Slide;

    /// Saves or loads what the slides keep.
    fn archive(&mut self, archive: &mut Archive<'_>) {
        for direction in Direction::BOTH {
            self.get_mut(direction).archive(direction, archive);
        }
    }
}

/// A surface that is the same either way: one slide, and no question which.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SymmetricSlides<S>(pub(crate) S);

impl<S: Slide> Sides for SymmetricSlides<S> {
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
pub(crate) struct DirectionalSlides<S> {
    positive: S,
    negative: S,
}

impl<S> DirectionalSlides<S> {
    /// The slides that `slide` makes.
    pub(crate) fn new(slide: impl Fn(Direction) -> S) -> Self {
        Self {
            positive: slide(Direction::Positive),
            negative: slide(Direction::Negative),
        }
    }
}

impl<S: Slide> Sides for DirectionalSlides<S> {
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
