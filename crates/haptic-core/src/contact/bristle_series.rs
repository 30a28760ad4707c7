//! Recurrences that several bristles share: the force `p` of a bristle along the motion, which
//! follows it by its elastic share, `p' = sigma w rho`, and the friction `p + sigma1 w rho`.

use super::level::{Fall, FallSeries};
use crate::series::{Newest, Path, RECIPROCAL, Recurrence, Series, inner, integral_of_product};

/// A bristle this near its steady force, N, is there: its tail would be stiff, and is not felt.
pub(crate) const SETTLED_N: f64 = 1e-11;

/// The bristle's force, and what of the motion it takes up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BristleForce {
    stiffness: f64,
    damping: f64,
    force: Series,
    /// `w rho`, m/s.
    taken: Series,
    last: usize,
}

impl BristleForce {
    /// `stiffness` is `sigma`, N/m, `damping` `sigma1`, N s/m, and `force` what it has along the
    /// motion, N.
    pub(crate) fn new(stiffness: f64, damping: f64, force: f64) -> Self {
        let mut series = Self {
            stiffness,
            damping,
            force: Series::ZERO,
            taken: Series::ZERO,
            last: 0,
        };
        series.force.set(0, force);
        series
    }

    /// The coefficient of order `n`, N; there is one more than have been asked for.
    pub(crate) fn get(&self, n: usize) -> f64 {
        self.force.get(n)
    }

    /// Takes the coefficient of order `N` of `w rho`, and gives that of the friction, N.
    #[inline(always)]
    pub(crate) fn take<const N: usize>(&mut self, taken: f64, duration_s: f64) -> f64 {
        self.taken.set(N, taken);
        self.force
            .set(N + 1, self.stiffness * duration_s * RECIPROCAL[N + 1] * taken);
        self.last = N + 1;
        self.force.get(N) + self.damping * taken
    }

    /// The size of its newest coefficient, N.
    pub(crate) fn next_size(&self) -> f64 {
        self.force.get(self.last).abs()
    }

    /// Its value, N.
    pub(crate) fn at(&self, time: f64) -> f64 {
        self.force.at(time, self.last)
    }

    /// Energy that it took and does not hold, J: `p (w - w rho) + sigma1 w (w rho)`, integrated.
    pub(crate) fn dissipated(&self, path: &Path, end: f64) -> f64 {
        let last = self.last - 1;
        let (speed, taken) = (|n| path.speed.get(n), |n| self.taken.get(n));
        let lost = integral_of_product(|n| self.force.get(n), |n| speed(n) - taken(n), end, last);
        let damped = if self.damping == 0.0 {
            0.0
        } else {
            self.damping * integral_of_product(speed, taken, end, last)
        };
        path.duration_s * (lost + damped)
    }
}

/// A bristle under a constant limit, `rho = r = 1 - p/limit`: `r' = -(sigma/limit) w r`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TowardsLimit {
    pub(crate) bristle: BristleForce,
    inverse_limit: f64,
    rest: Series,
    tolerance_n: f64,
}

impl TowardsLimit {
    /// `tolerance_n` is what the series may leave out, N.
    pub(crate) fn new(bristle: BristleForce, limit: f64, tolerance_n: f64) -> Self {
        let mut rest = Series::ZERO;
        rest.set(0, 1.0 - bristle.get(0) / limit);
        Self {
            bristle,
            inverse_limit: 1.0 / limit,
            rest,
            tolerance_n,
        }
    }
}

impl Recurrence for TowardsLimit {
    const LOOK_BACK: usize = 2;
    const FEWEST_ORDERS: usize = 4;

    fn tolerance_n(&self) -> f64 {
        self.tolerance_n
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        let speed = newest.speed;
        let known = inner::<N>(&path.speed, &self.rest);
        let taken = if N == 0 {
            speed * self.rest.get(0)
        } else {
            (known + path.speed.get(0) * self.rest.get(N)) + speed * self.rest.get(0)
        };
        let friction = self.bristle.take::<N>(taken, path.duration_s);
        self.rest.set(N + 1, -self.inverse_limit * self.bristle.get(N + 1));
        friction
    }

    fn next_size(&self) -> f64 {
        self.bristle.next_size()
    }
}

/// The force of a bristle over its steady force at the speed of the moment: `u = p/g(w)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RatioSeries {
    inverse_level: f64,
    fall: Option<FallSeries>,
    pub(crate) ratio: Series,
}

impl RatioSeries {
    /// `kinetic` is the steady force of a fast slide, N; `fall` what it falls by, with its value at
    /// the start.
    pub(crate) fn new(kinetic: f64, fall: Option<(&Fall, f64)>) -> Self {
        let level = kinetic + fall.map_or(0.0, |(_, at_start)| at_start);
        Self {
            inverse_level: 1.0 / level,
            fall: fall.map(|(fall, at_start)| FallSeries::new(fall, at_start)),
            ratio: Series::ZERO,
        }
    }

    /// The size of what its newest coefficient hides, N.
    pub(crate) fn size(&self) -> f64 {
        self.fall.as_ref().map_or(0.0, FallSeries::size)
    }

    /// The coefficient of order `N` for one of the force, N, after the products of that order.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(&mut self, force: f64, path: &Path, newest: Newest) -> f64 {
        let ratio = match &mut self.fall {
            Some(fall) if N > 0 => {
                let known = self.inverse_level * (force - inner::<N>(&fall.force, &self.ratio));
                let a_newton = self.inverse_level * self.ratio.get(0);
                known - a_newton * fall.next::<N>(path, newest)
            }
            _ => self.inverse_level * force,
        };
        self.ratio.set(N, ratio);
        ratio
    }
}

/// Orders that a series with Stribeck's curve in it has at least: it may begin where next to nothing
/// of the curve is left, and come to feel it.
pub(crate) const FEWEST_ON_CURVE: usize = 8;
/// And the coefficients that are looked back on: those of a bell curve go up and down.
pub(crate) const LOOK_BACK_ON_CURVE: usize = 6;

/// A bristle under Stribeck's curve, `rho = 1 - u`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnderCurve {
    pub(crate) bristle: BristleForce,
    pub(crate) ratio: RatioSeries,
    /// What the series may leave out, N.
    pub(crate) tolerance_n: f64,
}

impl Recurrence for UnderCurve {
    const LOOK_BACK: usize = LOOK_BACK_ON_CURVE;
    const FEWEST_ORDERS: usize = FEWEST_ON_CURVE;

    fn tolerance_n(&self) -> f64 {
        self.tolerance_n
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        let speed = newest.speed;
        let known = inner::<N>(&path.speed, &self.ratio.ratio);
        let ratio = self.ratio.next::<N>(self.bristle.get(N), path, newest);
        let taken = if N == 0 {
            speed * (1.0 - ratio)
        } else {
            (speed * (1.0 - self.ratio.ratio.get(0)) - known) - path.speed.get(0) * ratio
        };
        self.bristle.take::<N>(taken, path.duration_s)
    }

    fn next_size(&self) -> f64 {
        self.bristle.next_size().max(self.ratio.size())
    }
}
