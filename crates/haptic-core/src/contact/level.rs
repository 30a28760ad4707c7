//! Kinetic friction as a function of speed: a constant, or Stribeck's curve.

use crate::direction::Direction;
use crate::directional::Directional;
use crate::math::exp;
use core::fmt::Debug;

/// Friction while sliding, without its viscous part.
pub(crate) trait Level: Clone + Copy + Debug + Send + Sync + 'static {
    /// Whether it depends on speed at all.
    const VARIES: bool;
    /// At a speed (m/s, >= 0), N.
    fn at(&self, direction: Direction, speed: f64) -> f64;
    /// Its slope there, N s/m; negative where it falls.
    fn slope(&self, direction: Direction, speed: f64) -> f64;
    /// Its value for fast motion, N: the smallest where it falls.
    fn kinetic(&self, direction: Direction) -> f64;
    /// A slide sets off at a static limit (N) that need not be the whole one: a curve begins there.
    fn set_off(&mut self, _direction: Direction, _limit: f64) {}
}

impl Level for Directional {
    const VARIES: bool = false;

    fn at(&self, direction: Direction, _speed: f64) -> f64 {
        self.get(direction)
    }

    fn slope(&self, _direction: Direction, _speed: f64) -> f64 {
        0.0
    }

    fn kinetic(&self, direction: Direction) -> f64 {
        self.get(direction)
    }
}

/// A velocity below which Stribeck's fall counts as sudden, m/s.
pub const SUDDEN_FALL_MPS: f64 = 1e-6;

/// `Fd + (Fs - Fd) e^-(w/ws)^2` (Stribeck 1902, in the Gaussian form of Bo and Pavelescu 1982).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stribeck {
    pub(crate) static_force: Directional,
    pub(crate) dynamic_force: Directional,
    /// `ws`, m/s, at least [`SUDDEN_FALL_MPS`].
    pub(crate) velocity: f64,
}

/// Beyond this many `ws` the exponential is less than the last digit.
const FALLEN: f64 = 6.1;

/// Stribeck's curve in one direction.
pub(crate) fn stribeck(static_force: f64, dynamic_force: f64, velocity: f64, speed: f64) -> (f64, f64) {
    let ratio = speed / velocity;
    if ratio > FALLEN {
        return (dynamic_force, 0.0);
    }
    let above = (static_force - dynamic_force) * exp(-ratio * ratio);
    (dynamic_force + above, -2.0 * above * ratio / velocity)
}

impl Level for Stribeck {
    const VARIES: bool = true;

    fn at(&self, direction: Direction, speed: f64) -> f64 {
        stribeck(
            self.static_force.get(direction),
            self.dynamic_force.get(direction),
            self.velocity,
            speed,
        )
        .0
    }

    fn slope(&self, direction: Direction, speed: f64) -> f64 {
        stribeck(
            self.static_force.get(direction),
            self.dynamic_force.get(direction),
            self.velocity,
            speed,
        )
        .1
    }

    fn kinetic(&self, direction: Direction) -> f64 {
        self.dynamic_force.get(direction)
    }

    fn set_off(&mut self, direction: Direction, limit: f64) {
        *self.static_force.get_mut(direction) = limit;
    }
}
