//! Kinetic friction as a function of speed: a constant, or Stribeck's curve.

use crate::direction::Direction;
use crate::directional::Directional;
use crate::math::{exp, ln, sqrt};
use crate::series::{Newest, Path, RECIPROCAL, Series, inner, inner_square};
use core::fmt::Debug;

/// Friction while sliding, without its viscous part.
pub(crate) trait Level: Clone + Copy + Debug + Send + Sync + 'static {
    /// Whether it depends on speed at all.
    const VARIES: bool;
    /// At a speed (m/s, >= 0), N.
    fn at(&self, direction: Direction, speed: f64) -> f64;
    /// Its value for fast motion, N: the smallest where it falls.
    fn kinetic(&self, direction: Direction) -> f64;
    /// A slide sets off at a static limit (N) that need not be the whole one: a curve begins there.
    fn set_off(&mut self, _direction: Direction, _limit: f64) {}
    /// Its part that falls with speed; `None` where there is none.
    fn fall(&self, _direction: Direction) -> Option<Fall> {
        None
    }
}

impl Level for Directional {
    const VARIES: bool = false;

    fn at(&self, direction: Direction, _speed: f64) -> f64 {
        self.get(direction)
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

impl Level for Stribeck {
    const VARIES: bool = true;

    fn at(&self, direction: Direction, speed: f64) -> f64 {
        let dynamic_force = self.dynamic_force.get(direction);
        let ratio = speed / self.velocity;
        if ratio > FALLEN {
            return dynamic_force;
        }
        dynamic_force + (self.static_force.get(direction) - dynamic_force) * exp(-ratio * ratio)
    }

    fn kinetic(&self, direction: Direction) -> f64 {
        self.dynamic_force.get(direction)
    }

    fn set_off(&mut self, direction: Direction, limit: f64) {
        *self.static_force.get_mut(direction) = limit;
    }

    fn fall(&self, direction: Direction) -> Option<Fall> {
        let excess = self.static_force.get(direction) - self.dynamic_force.get(direction);
        Some(Fall {
            excess,
            velocity: self.velocity,
            fallen_from: fallen_from(excess, self.velocity),
        })
    }
}

/// What of Stribeck's curve counts as nothing, N.
const FALLEN_N: f64 = 1e-12;

/// The speed, m/s, above which an excess (N) over the kinetic force has fallen to [`FALLEN_N`].
/// A series begun there would find nothing of the curve, and would not know of it below.
pub(crate) fn fallen_from(excess: f64, velocity: f64) -> f64 {
    if excess.abs() <= FALLEN_N {
        return 0.0;
    }
    velocity * sqrt(ln(excess.abs() / FALLEN_N))
}

/// The part of Stribeck's curve above the kinetic force, in one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fall {
    /// At rest, N; negative where the curve rises.
    pub(crate) excess: f64,
    /// `ws`, m/s.
    pub(crate) velocity: f64,
    /// From [`fallen_from`], m/s.
    pub(crate) fallen_from: f64,
}

impl Fall {
    /// At a speed, N.
    pub(crate) fn at(&self, speed: f64) -> f64 {
        let ratio = speed / self.velocity;
        self.excess * exp(-ratio * ratio)
    }
}

/// Share of the curve's coefficients that counts whatever comes of them in the motion: where they
/// still grow at the last order, what they do to the motion says nothing of those that follow.
const COUNTS: f64 = 0.01;

/// The series `E = excess e^-q`, `q = (w/ws)^2`: `n E[n] = -sum k q[k] E[n-k]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FallSeries {
    inverse_square: f64,
    /// `k q[k]`.
    slope: Series,
    pub(crate) force: Series,
    newest: f64,
}

impl FallSeries {
    /// `at_start` is the force at the speed of the start.
    pub(crate) fn new(fall: &Fall, at_start: f64) -> Self {
        let mut series = Self {
            inverse_square: 1.0 / (fall.velocity * fall.velocity),
            slope: Series::ZERO,
            force: Series::ZERO,
            newest: at_start,
        };
        series.force.set(0, at_start);
        series
    }

    /// The size of its newest coefficient, N.
    pub(crate) fn size(&self) -> f64 {
        COUNTS * self.newest.abs()
    }

    /// The coefficient of order `N`, N.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            return self.force.get(0);
        }
        let (speed, first) = (path.speed.get(0), self.force.get(0));
        let squares = self.inverse_square * inner_square::<N>(&path.speed);
        let fallen = RECIPROCAL[N] * inner::<N>(&self.slope, &self.force);
        let a_speed = 2.0 * self.inverse_square * speed;
        let force = -(fallen + first * squares) - first * a_speed * newest.speed;
        self.slope.set(N, N as f64 * (squares + a_speed * newest.speed));
        self.force.set(N, force);
        self.newest = force;
        force
    }
}
