//! Dahl's law with an exponent `i` that is neither 0 nor 1: `Y = r^(1-i)` is a straight line of the
//! way, and `r = Y^m` with `m = 1/(1-i)`, whose series is that of a power:
//!
//! ```text
//! n Y[0] r[n] = sum of ((m + 1) k - n) Y[k] r[n-k], k from 1 to n
//! ```

use crate::math::{exp, ln_1p, powf, sqrt};
use crate::series::{Newest, Path, Products, RECIPROCAL, Recurrence, Series};

/// The friction of one direction in one piece.
pub(crate) struct PowerSeries {
    limit: f64,
    exponent: f64,
    /// `m + 1`.
    power_and_one: f64,
    /// `1/Y[0]`.
    inverse_first: f64,
    /// `dY/dx`, 1/m.
    slope: f64,
    at_start: f64,
    rest_at_start: f64,
    /// `Y` and `n Y[n]`, both by `r`, or by `Y` itself where `r` is its square.
    products: Products,
    friction: Series,
    next_size: f64,
}

/// The exponent under which `r` is the square of `Y`.
const SQUARE: f64 = 0.5;

impl PowerSeries {
    /// `exponent` is `i`, `stiffness` `sigma`, N/m, `limit` `Fc`, N, and `rest` `r` at the start.
    pub(crate) fn new(exponent: f64, stiffness: f64, limit: f64, rest: f64) -> Self {
        let at_start = if exponent == SQUARE {
            sqrt(rest)
        } else {
            powf(rest, 1.0 - exponent)
        };
        Self {
            limit,
            exponent,
            power_and_one: 1.0 / (1.0 - exponent) + 1.0,
            inverse_first: 1.0 / at_start,
            slope: (exponent - 1.0) * stiffness / limit,
            at_start,
            rest_at_start: rest,
            products: Products::ZERO,
            friction: Series::ZERO,
            next_size: 0.0,
        }
    }

    /// The coefficient of order `n` of `Y`.
    pub(crate) fn line(&self, n: usize) -> f64 {
        self.products.left(n)[0]
    }

    /// The coefficient of order `n` of the friction, N.
    pub(crate) fn force(&self, n: usize) -> f64 {
        self.friction.get(n)
    }

    /// The way to the limit, m, which an exponent below 1 has.
    pub(crate) fn way_to_limit(&self) -> f64 {
        -self.at_start / self.slope
    }

    /// `r` after a way, m.
    pub(crate) fn rest_at(&self, distance: f64) -> f64 {
        let line = self.at_start + self.slope * distance;
        if line <= 0.0 {
            0.0
        } else if self.exponent == SQUARE {
            line * line
        } else {
            // The logarithm keeps its digits where i is near 1.
            exp(ln_1p(line - 1.0) / (1.0 - self.exponent))
        }
    }

    /// The coefficient of order `N` of `r`, for one of the line.
    #[inline(always)]
    fn rest<const N: usize>(&mut self, line: f64) -> f64 {
        let [known, weighted] = self.products.inner::<N>();
        let weight = N as f64;
        if self.exponent == SQUARE {
            self.products.set(N, [line, 0.0], [line; 2]);
            return known + 2.0 * self.at_start * line;
        }
        let first = self.rest_at_start;
        let weighted = weighted + weight * line * first;
        let rest = (self.power_and_one * weighted * RECIPROCAL[N] - (known + line * first)) * self.inverse_first;
        self.products.set(N, [line, weight * line], [rest; 2]);
        rest
    }
}

impl Recurrence for PowerSeries {
    const LOOK_BACK: usize = 2;
    const FEWEST_ORDERS: usize = 4;

    #[inline(always)]
    fn friction<const N: usize>(&mut self, _path: &Path, newest: Newest) -> f64 {
        let friction = if N == 0 {
            let factor = if self.exponent == SQUARE {
                self.at_start
            } else {
                self.rest_at_start
            };
            self.products.set(0, [self.at_start, 0.0], [factor; 2]);
            self.limit * (1.0 - self.rest_at_start)
        } else {
            -self.limit * self.rest::<N>(self.slope * newest.distance)
        };
        self.friction.set(N, friction);
        self.next_size = friction.abs();
        friction
    }

    fn next_size(&self) -> f64 {
        // That of the order before it, which is more.
        self.next_size
    }
}
