//! Kinetic friction as a function of speed: a constant, or Stribeck's curve.

use crate::directional::{Direction, Directional};
use crate::math::{exp, ln, sqrt};
use crate::series::{Newest, Products, RECIPROCAL};
use crate::snapshot::Archive;
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
    /// That limit, N, where a curve begins at it.
    fn set_off_at(&self, _direction: Direction) -> Option<f64> {
        None
    }
    /// Saves or loads where its curves begin.
    fn archive(&mut self, _archive: &mut Archive<'_>) {}
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
    /// From [`fallen_from`], m/s.
    fallen_from: Directional,
}

impl Stribeck {
    /// `velocity` is `ws`, m/s, at least [`SUDDEN_FALL_MPS`].
    pub(crate) fn new(static_force: Directional, dynamic_force: Directional, velocity: f64) -> Self {
        let mut curve = Self {
            static_force,
            dynamic_force,
            velocity,
            fallen_from: Directional::both(0.0),
        };
        for direction in Direction::BOTH {
            curve.set_off(direction, static_force.get(direction));
        }
        curve
    }
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
        let excess = limit - self.dynamic_force.get(direction);
        *self.fallen_from.get_mut(direction) = fallen_from(excess, self.velocity);
    }

    fn set_off_at(&self, direction: Direction) -> Option<f64> {
        Some(self.static_force.get(direction))
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        let mut begins = Direction::BOTH.map(|direction| self.static_force.get(direction));
        archive.numbers("set_off_N", &mut begins);
        if archive.is_loading() {
            for (direction, limit) in Direction::BOTH.into_iter().zip(begins) {
                self.set_off(direction, limit);
            }
        }
    }

    fn fall(&self, direction: Direction) -> Option<Fall> {
        let excess = self.static_force.get(direction) - self.dynamic_force.get(direction);
        Some(Fall {
            excess,
            velocity: self.velocity,
            fallen_from: self.fallen_from.get(direction),
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
    /// Share of the speed's newest coefficient in that of `q`, s/m.
    square_per_speed: f64,
    /// And in that of `E`, N s/m.
    pub(crate) per_speed: f64,
    /// The force at the start, N.
    pub(crate) at_start: f64,
    /// `k q[k] E`, and the square of the speed.
    products: Products,
    newest: f64,
}

impl FallSeries {
    /// From a speed, m/s.
    #[inline(always)]
    pub(crate) fn new(fall: &Fall, speed: f64) -> Self {
        let at_start = fall.at(speed);
        let inverse_square = 1.0 / (fall.velocity * fall.velocity);
        let square_per_speed = 2.0 * inverse_square * speed;
        Self {
            inverse_square,
            square_per_speed,
            per_speed: -at_start * square_per_speed,
            at_start,
            products: Products::ZERO,
            newest: at_start,
        }
    }

    /// Sets the coefficients of order 0.
    #[inline(always)]
    pub(crate) fn begin(&mut self, newest: Newest) {
        self.products.set(0, [0.0, newest.speed], [self.at_start, newest.speed]);
    }

    /// The coefficient of order `n`, N.
    pub(crate) fn get(&self, n: usize) -> f64 {
        self.products.right(n)[0]
    }

    /// The size of its newest coefficient, N.
    #[inline(always)]
    pub(crate) fn size(&self) -> f64 {
        COUNTS * self.newest.abs()
    }

    /// Adds the coefficient of order `N`, N, from 1 on. Gives it without the speed's newest
    /// coefficient.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(&mut self, Newest { speed, .. }: Newest) -> f64 {
        let [fallen, squares] = self.products.inner::<N>();
        let known = -(RECIPROCAL[N] * fallen + (self.at_start * self.inverse_square) * squares);
        let slope = N as f64 * (self.inverse_square * squares + self.square_per_speed * speed);
        self.newest = known + self.per_speed * speed;
        self.products.set(N, [slope, speed], [self.newest, speed]);
        known
    }
}
