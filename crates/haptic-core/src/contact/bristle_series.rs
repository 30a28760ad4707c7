//! Recurrences that several bristles share: the force `p` of a bristle along the motion, which
//! follows it by its elastic share, `p' = sigma w rho`, and the friction `p + sigma1 w rho`.

use super::level::FallSeries;
use crate::series::{Newest, Path, Products, RECIPROCAL, Recurrence, Series, inner, integral_of_product};

/// A bristle this near its steady force, N, is there: its tail would be stiff, and is not felt.
pub(crate) const SETTLED_N: f64 = 1e-11;

/// The bristle's force, and what of the motion it takes up. One that is not `DAMPED` has no
/// `sigma1`, so that its friction does not wait for what it takes up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BristleForce<const DAMPED: bool> {
    /// `sigma H`, N s/m: force of a speed over the series' own time.
    rate: f64,
    damping: f64,
    /// The force at the start, N.
    at_start: f64,
    force: Series,
    /// `w rho`, m/s.
    taken: Series,
    /// Share of the speed's newest coefficient in that of `w rho`, from order 1 on.
    uptake: f64,
    last: usize,
}

impl<const DAMPED: bool> BristleForce<DAMPED> {
    /// `duration_s` is the series' own time, s, `stiffness` `sigma`, N/m, `damping` `sigma1`, N s/m,
    /// and `force` what it has along the motion, N.
    #[inline(always)]
    pub(crate) fn new(duration_s: f64, stiffness: f64, damping: f64, force: f64) -> Self {
        Self {
            rate: stiffness * duration_s,
            damping,
            at_start: force,
            force: Series::ZERO,
            taken: Series::ZERO,
            uptake: 0.0,
            last: 0,
        }
    }

    /// The force at the start, N.
    pub(crate) fn at_start(&self) -> f64 {
        self.at_start
    }

    /// The coefficient of order `n`, N; there is one more than have been asked for.
    pub(crate) fn get(&self, n: usize) -> f64 {
        self.force.get(n)
    }

    /// Takes the coefficient of order 0 of `w rho`, and the share of the speed's newest coefficient
    /// that later ones contain. Gives the coefficient of the friction, N.
    #[inline(always)]
    pub(crate) fn begin(&mut self, taken: f64, uptake: f64) -> f64 {
        self.uptake = uptake;
        self.force.set(0, self.at_start);
        self.take::<0>(taken);
        self.friction::<0>(taken)
    }

    /// Takes the coefficient of order `N` of `w rho`, from 1 on, without that share. Gives the
    /// coefficient of the friction without it, N.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(&mut self, known: f64, newest: Newest) -> f64 {
        self.take::<N>(known + self.uptake * newest.speed);
        self.friction::<N>(known)
    }

    #[inline(always)]
    fn take<const N: usize>(&mut self, taken: f64) {
        self.taken.set(N, taken);
        self.force.set(N + 1, self.rate * RECIPROCAL[N + 1] * taken);
        self.last = N + 1;
    }

    #[inline(always)]
    fn friction<const N: usize>(&self, taken: f64) -> f64 {
        let force = self.force.get(N);
        if DAMPED { force + self.damping * taken } else { force }
    }

    /// [`Recurrence::newest_damping`].
    pub(crate) fn newest_damping(&self) -> f64 {
        self.damping * self.uptake
    }

    /// The size of its newest coefficient, N.
    pub(crate) fn next_size(&self) -> f64 {
        self.force.get(self.last).abs()
    }

    /// Its value, N.
    pub(crate) fn at(&self, time: f64) -> f64 {
        self.force.at(time)
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
pub(crate) struct TowardsLimit<const DAMPED: bool> {
    pub(crate) bristle: BristleForce<DAMPED>,
    /// Change of `r` by what is taken up, over the series' own time, s/m.
    rate: f64,
    rest_at_start: f64,
    rest: Series,
    tolerance_n: f64,
}

impl<const DAMPED: bool> TowardsLimit<DAMPED> {
    /// `tolerance_n` is what the series may leave out, N.
    #[inline(always)]
    pub(crate) fn new(bristle: BristleForce<DAMPED>, limit: f64, tolerance_n: f64) -> Self {
        let inverse_limit = 1.0 / limit;
        Self {
            rate: -bristle.rate * inverse_limit,
            rest_at_start: 1.0 - bristle.at_start * inverse_limit,
            rest: Series::ZERO,
            tolerance_n,
            bristle,
        }
    }
}

impl<const DAMPED: bool> Recurrence for TowardsLimit<DAMPED> {
    const LOOK_BACK: usize = 2;
    const MIN_ORDERS: usize = 4;

    fn tolerance_n(&self) -> f64 {
        self.tolerance_n
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        let friction = if N == 0 {
            let rest = self.rest_at_start;
            self.rest.set(0, rest);
            self.bristle.begin(newest.speed * rest, rest)
        } else {
            let known = inner::<N>(&path.speed, &self.rest) + path.speed.get(0) * self.rest.get(N);
            self.bristle.next::<N>(known, newest)
        };
        self.rest
            .set(N + 1, self.rate * RECIPROCAL[N + 1] * self.bristle.taken.get(N));
        friction
    }

    fn newest_damping(&self) -> f64 {
        self.bristle.newest_damping()
    }

    #[inline(always)]
    fn next_size(&self) -> f64 {
        self.bristle.next_size()
    }
}

/// The force of a bristle over its steady force at the speed of the moment: `u = p/g(w)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RatioSeries {
    inverse_level: f64,
    pub(crate) at_start: f64,
    /// What a newton of the fall takes from it, 1/N.
    per_fall: f64,
    /// Share of the speed's newest coefficient in that of the ratio, s/m.
    pub(crate) per_speed: f64,
    fall: Option<FallSeries>,
    /// `E u` and `w u`.
    products: Products,
}

impl RatioSeries {
    /// For a bristle's force at the start, N, over the steady force of a fast slide, N, and a fall
    /// from there.
    #[inline(always)]
    pub(crate) fn new(force: f64, kinetic: f64, fall: Option<FallSeries>) -> Self {
        let (above, per_speed) = fall.as_ref().map_or((0.0, 0.0), |fall| (fall.at_start, fall.per_speed));
        let inverse_level = 1.0 / (kinetic + above);
        let at_start = inverse_level * force;
        let per_fall = inverse_level * at_start;
        Self {
            inverse_level,
            at_start,
            per_fall,
            per_speed: -per_fall * per_speed,
            fall,
            products: Products::ZERO,
        }
    }

    /// Sets the coefficients of order 0.
    #[inline(always)]
    pub(crate) fn begin(&mut self, newest: Newest) {
        let above = self.fall.as_ref().map_or(0.0, |fall| fall.at_start);
        self.products.set(0, [above, newest.speed], [self.at_start; 2]);
        if let Some(fall) = &mut self.fall {
            fall.begin(newest);
        }
    }

    /// The coefficient of order `n`.
    pub(crate) fn get(&self, n: usize) -> f64 {
        self.products.right(n)[0]
    }

    /// The size of what its newest coefficient hides, N.
    pub(crate) fn size(&self) -> f64 {
        self.fall.as_ref().map_or(0.0, FallSeries::size)
    }

    /// Adds the coefficient of order `N`, from 1 on, for one of the force, N. Gives it without the
    /// speed's newest coefficient, and under a fall the inner sum of `w u`.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(&mut self, force: f64, newest: Newest) -> (f64, f64) {
        let (mut known, mut moved, mut above) = (self.inverse_level * force, 0.0, 0.0);
        if let Some(fall) = &mut self.fall {
            let [fallen, with_speed] = self.products.inner::<N>();
            let known_above = fall.next::<N>(newest);
            known = self.inverse_level * (force - fallen) - self.per_fall * known_above;
            (moved, above) = (with_speed, fall.get(N));
        }
        let ratio = known + self.per_speed * newest.speed;
        self.products.set(N, [above, newest.speed], [ratio; 2]);
        (known, moved)
    }
}

/// Orders that a series with Stribeck's curve in it has at least: it may begin where next to nothing
/// of the curve is left, and come to feel it.
pub(crate) const MIN_ON_CURVE: usize = 8;
/// And the coefficients that are looked back on: those of a bell curve go up and down.
pub(crate) const LOOK_BACK_ON_CURVE: usize = 6;

/// A bristle under Stribeck's curve, `rho = 1 - u`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnderCurve {
    pub(crate) bristle: BristleForce<true>,
    pub(crate) ratio: RatioSeries,
    /// What the series may leave out, N.
    pub(crate) tolerance_n: f64,
}

impl Recurrence for UnderCurve {
    const LOOK_BACK: usize = LOOK_BACK_ON_CURVE;
    const MIN_ORDERS: usize = MIN_ON_CURVE;

    fn tolerance_n(&self) -> f64 {
        self.tolerance_n
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            self.ratio.begin(newest);
            let (speed, share) = (newest.speed, 1.0 - self.ratio.at_start);
            return self.bristle.begin(speed * share, share - speed * self.ratio.per_speed);
        }
        let (ratio, moved) = self.ratio.next::<N>(self.bristle.get(N), newest);
        self.bristle.next::<N>(-moved - path.speed.get(0) * ratio, newest)
    }

    fn newest_damping(&self) -> f64 {
        self.bristle.newest_damping()
    }

    #[inline(always)]
    fn next_size(&self) -> f64 {
        self.bristle.next_size().max(self.ratio.size())
    }
}
