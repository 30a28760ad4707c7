//! Dahl's law with an exponent `i` that is neither 0 nor 1. With `e = 1 - i` and `X = sigma x/Fc`, `Y =
//! r^e = Y[0] - e X` is a straight line of the distance, and the series of `r = Y^(1/e)` is that of a power,
//! which the exponential of `e = 0` has no less:
//!
//! ```text
//! n Y[0] r[n] = sum of (e n - (1 + e) k) X[k] r[n-k], k from 1 to n
//! ```

use crate::math::{exp, ln_1p, powf, sqrt};
use crate::series::{Newest, Path, Products, RECIPROCAL, Recurrence, Series};

/// The friction of one direction in one piece.
pub(crate) struct PowerSeries {
    limit: f64,
    /// `e`.
    root: f64,
    /// `1/Y[0]`.
    inverse_first: f64,
    /// `X/x`, 1/m.
    slope: f64,
    /// `Y[0]`.
    at_start: f64,
    rest_at_start: f64,
    /// `X` and `n X[n]`, both by `r`, or by `Y` where `r` is its square.
    products: Products,
    friction: Series,
    next_size: f64,
}

/// The `e` under which `r` is the square of `Y`.
const SQUARE: f64 = 0.5;

impl PowerSeries {
    /// `exponent` is `i`, `stiffness` `sigma`, N/m, `limit` `Fc`, N, and `rest` `r` at the start.
    pub(crate) fn new(exponent: f64, stiffness: f64, limit: f64, rest: f64) -> Self {
        let root = 1.0 - exponent;
        let at_start = if root == SQUARE { sqrt(rest) } else { powf(rest, root) };
        Self {
            limit,
            root,
            inverse_first: 1.0 / at_start,
            slope: stiffness / limit,
            at_start,
            rest_at_start: rest,
            products: Products::ZERO,
            friction: Series::ZERO,
            next_size: 0.0,
        }
    }

    /// The distance on which it converges, m; endless for an exponent of 1.
    pub(crate) fn radius(&self) -> f64 {
        self.at_start / (self.root * self.slope).abs()
    }

    /// The coefficient of order `n` of `Y`.
    pub(crate) fn line(&self, n: usize) -> f64 {
        if n == 0 {
            self.at_start
        } else {
            -self.root * self.products.left(n)[0]
        }
    }

    /// The coefficient of order `n` of the friction, N.
    pub(crate) fn force(&self, n: usize) -> f64 {
        self.friction.get(n)
    }

    /// The distance to the limit, m, which an exponent below 1 has.
    pub(crate) fn distance_to_limit(&self) -> f64 {
        self.at_start / (self.root * self.slope)
    }

    /// `r` after a distance, m.
    pub(crate) fn rest_at(&self, distance: f64) -> f64 {
        let fallen = -self.root * self.slope * distance * self.inverse_first;
        if fallen <= -1.0 {
            0.0
        } else {
            // The logarithm keeps its digits where i is near 1.
            self.rest_at_start * exp(ln_1p(fallen) / self.root)
        }
    }

    /// The coefficient of order `N` of `r`, for one of `X`.
    #[inline(always)]
    fn rest<const N: usize>(&mut self, x: f64) -> f64 {
        let [known, weighted] = self.products.inner::<N>();
        if self.root == SQUARE {
            let line = -SQUARE * x;
            self.products.set(N, [x, 0.0], [line; 2]);
            return -SQUARE * known + 2.0 * self.at_start * line;
        }
        let weight = N as f64;
        let first = x * self.rest_at_start;
        let (known, weighted) = (known + first, weighted * RECIPROCAL[N] + first);
        let rest = (self.root * known - (1.0 + self.root) * weighted) * self.inverse_first;
        self.products.set(N, [x, weight * x], [rest; 2]);
        rest
    }
}

impl Recurrence for PowerSeries {
    const LOOK_BACK: usize = 2;
    const MIN_ORDERS: usize = 4;

    #[inline(always)]
    fn friction<const N: usize>(&mut self, _path: &Path, newest: Newest) -> f64 {
        let friction = if N == 0 {
            let factor = if self.root == SQUARE {
                self.at_start
            } else {
                self.rest_at_start
            };
            self.products.set(0, [0.0; 2], [factor; 2]);
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
