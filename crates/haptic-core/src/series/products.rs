//! Two products of series at once, each in its half of the processor's registers.

use super::ROOM;

/// The coefficients of two series, side by side.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
struct Pairs([[f64; 2]; ROOM]);

/// Two products: the factors of each, whose coefficients come order by order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Products {
    left: Pairs,
    right: Pairs,
}

impl Products {
    pub(crate) const ZERO: Self = Self {
        left: Pairs([[0.0; 2]; ROOM]),
        right: Pairs([[0.0; 2]; ROOM]),
    };

    /// Sets the coefficients of order `n`: the left factors of both products, and the right ones.
    pub(crate) fn set(&mut self, n: usize, left: [f64; 2], right: [f64; 2]) {
        self.left.0[n] = left;
        self.right.0[n] = right;
    }

    /// The coefficients of order `n` of the left factors.
    pub(crate) fn left(&self, n: usize) -> [f64; 2] {
        self.left.0[n]
    }

    /// The coefficients of order `n` of the right factors.
    pub(crate) fn right(&self, n: usize) -> [f64; 2] {
        self.right.0[n]
    }

    /// Of order `N` of both products, from 1 on, what is known before their own coefficients: the
    /// sum over `k` from 1 to `N - 1` of `left[k] right[N - k]`.
    #[inline(always)]
    pub(crate) fn inner<const N: usize>(&self) -> [f64; 2] {
        let older = if N > 3 {
            older::<N>(&self.left, &self.right)
        } else {
            (0.0, 0.0)
        };
        let (a, b) = (&self.left.0, &self.right.0);
        let sum = |half: usize, older: f64| match N {
            0 | 1 => 0.0,
            2 => a[1][half] * b[1][half],
            // The processor waits for these two alone.
            _ => older + (a[1][half] * b[N - 1][half] + a[N - 1][half] * b[1][half]),
        };
        [sum(0, older.0), sum(1, older.1)]
    }
}

/// The terms that are two orders old and more. Apart, so that the compiler loads pairs and adds
/// pairs: what it has seen being set it would take apart.
#[inline(never)]
fn older<const N: usize>(left: &Pairs, right: &Pairs) -> (f64, f64) {
    let (mut even, mut odd) = ([0.0; 2], [0.0; 2]);
    let add = |sum: &mut [f64; 2], k: usize| {
        let (a, b) = (left.0[k], right.0[N - k]);
        *sum = [sum[0] + a[0] * b[0], sum[1] + a[1] * b[1]];
    };
    for k in 1..(N - 1) / 2 {
        add(&mut even, 2 * k);
        add(&mut odd, 2 * k + 1);
    }
    if N.is_multiple_of(2) {
        add(&mut even, N - 2);
    }
    (even[0] + odd[0], even[1] + odd[1])
}
