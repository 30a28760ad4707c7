//! Power series of time, as far as a curved law needs them: each coefficient from those before it
//! (Moore 1966, "Interval analysis"; Griewank and Walther 2008, chapter 13).
//!
//! Time is scaled so that a series covers what is left of a tick from 0 to 1. A product of two
//! series is a sum whose terms but two are known before the newest coefficients are: [`inner`] is
//! that sum, and a law finishes it. Its terms add up in a fixed order: the same bits in every build.
//! The order is a constant to the compiler, so that nothing is left of the loops.
//!
//! A series is bound by how long each order waits for the one before it. So a law keeps what the
//! newest coefficients add apart from what is known already, and few operations lie between them;
//! the share of the speed's newest coefficient in the friction does not pass through the law at all
//! ([`Recurrence::newest_damping`]). A law with several products forms them in pairs ([`Products`]).

mod products;
mod roots;

pub(crate) use products::Products;
pub(crate) use roots::{falls_between, first_root, halve, root_between};

use core::ops::{Add, Mul};

/// Order up to which a series is kept.
pub(crate) const ORDER: usize = 20;

/// Coefficients of a series.
pub(crate) const ROOM: usize = ORDER + 1;

/// `1/n`, so that a recurrence divides nothing; as far as the longest one needs.
pub(crate) const RECIPROCAL: [f64; 25] = {
    let mut table = [0.0; 25];
    let mut n = 1;
    while n < 25 {
        table[n] = 1.0 / n as f64;
        n += 1;
    }
    table
};

/// A series.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series([f64; ROOM]);

impl Series {
    pub(crate) const ZERO: Self = Self([0.0; ROOM]);

    pub(crate) fn get(&self, n: usize) -> f64 {
        self.0[n]
    }

    pub(crate) fn set(&mut self, n: usize, coefficient: f64) {
        self.0[n] = coefficient;
    }

    pub(crate) fn coefficients(&self) -> &[f64; ROOM] {
        &self.0
    }

    /// Its value at a time.
    pub(crate) fn at(&self, time: f64) -> f64 {
        value(&self.0, time)
    }
}

/// The sum over `k` from 1 to `N - 1` of `a[k] b[N - k]`: of order `N` of the product what is known
/// before its own coefficients. For several products see [`Products`].
#[inline(always)]
pub(crate) fn inner<const N: usize>(a: &Series, b: &Series) -> f64 {
    if N < 2 {
        return 0.0;
    }
    if N == 2 {
        return a.0[1] * b.0[1];
    }
    let mut sums = [0.0; 4];
    for k in 2..N - 1 {
        sums[(k - 2) % 4] += a.0[k] * b.0[N - k];
    }
    let older = (sums[0] + sums[2]) + (sums[1] + sums[3]);
    // The processor waits for these two alone.
    older + (a.0[1] * b.0[N - 1] + a.0[N - 1] * b.0[1])
}

/// A polynomial's value: by pairs, which do not wait for each other (Estrin 1960).
pub(crate) fn value<T: Copy + Add<Output = T> + Mul<f64, Output = T>>(polynomial: &[T; ROOM], time: f64) -> T {
    let second = time * time;
    let fourth = second * second;
    let eighth = fourth * fourth;
    let pair = |k: usize| polynomial[k] + polynomial[k + 1] * time;
    let four = |k: usize| pair(k) + pair(k + 2) * second;
    let eight = |k: usize| four(k) + four(k + 4) * fourth;
    let highest = four(16) + polynomial[20] * fourth;
    (eight(0) + eight(8) * eighth) + highest * (eighth * eighth)
}

/// The integral from 0 to `end` of the product of two series, each of its coefficients up to
/// `last`.
pub(crate) fn integral_of_product(a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64, end: f64, last: usize) -> f64 {
    let mut integral = 0.0;
    for n in (0..=last).rev() {
        let product: f64 = (0..=n).map(|k| a(k) * b(n - k)).sum();
        integral = integral * end + product * RECIPROCAL[n + 1];
    }
    integral * end
}

/// The motion of a piece: displacement (m) along it, and speed (m/s).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// What the time 1 is, s.
    pub(crate) duration_s: f64,
    pub(crate) distance: Series,
    pub(crate) speed: Series,
}

impl Path {
    #[inline(always)]
    pub(crate) fn new(duration_s: f64) -> Self {
        Self {
            duration_s,
            distance: Series::ZERO,
            speed: Series::ZERO,
        }
    }

    pub(crate) fn set(&mut self, n: usize, distance: f64, speed: f64) {
        self.distance.set(n, distance);
        self.speed.set(n, speed);
    }
}

/// The newest coefficients of a motion; those of lower orders are in its path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Newest {
    pub(crate) distance: f64,
    pub(crate) speed: f64,
}

/// What a series leaves out where its law makes no more of it later, N.
pub(crate) const DEFAULT_TOLERANCE_N: f64 = 2e-10;
/// And where it does: the border of a regime or the speed at which a slide sets off moves with it.
pub(crate) const FINE_TOLERANCE_N: f64 = 2e-11;

/// A law in one of its regimes, for one piece: how its friction follows from the motion, order by
/// order.
pub(crate) trait Recurrence {
    /// Coefficients that are looked back on to say how the next ones go.
    const LOOK_BACK: usize;
    /// Orders that a series has at least before small coefficients are believed to be the last.
    const MIN_ORDERS: usize;

    /// What a series leaves out, N in the coupling or in the contact. It bounds the error of a
    /// piece; that of a tick is about as much, since what is left out falls off fast.
    fn tolerance_n(&self) -> f64 {
        DEFAULT_TOLERANCE_N
    }

    /// Share taken of the length that the last coefficients promise.
    fn caution(&self) -> f64 {
        1.0
    }

    /// The coefficient of order `N` of the friction without its viscous part, N, and from order 1 on
    /// without the share that [`newest_damping`](Self::newest_damping) gives. Orders come one after
    /// the other, from 0.
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64;

    /// Share of the speed's newest coefficient in that of the friction, N s/m, from order 1 on. It is
    /// asked for once, after order 0. The motion's next order then does not wait for the law.
    fn newest_damping(&self) -> f64 {
        0.0
    }

    /// The size of the coefficient of order `n + 1` of the law's own state, N, where the last one
    /// asked for was `n`.
    fn next_size(&self) -> f64;
}
