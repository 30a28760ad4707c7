//! Roots: the first of a polynomial on an interval, and one that two points enclose.
//!
//! Most polynomials asked for have none, which the sum of their negative terms shows. For the rest
//! the signs of their Bernstein coefficients count the roots (Descartes' rule; Lane and Riesenfeld
//! 1981): none, one, which a safeguarded Newton iteration finds, or maybe more, in which case the
//! interval is halved.

use super::{ROOM, value};

/// `1 / (n over k)`.
const INVERSE_BINOMIAL: [[f64; ROOM]; ROOM] = {
    let mut table = [[0.0; ROOM]; ROOM];
    let mut n = 0;
    while n < ROOM {
        let mut binomial = 1.0;
        let mut k = 0;
        while k <= n {
            table[n][k] = 1.0 / binomial;
            binomial = binomial * (n - k) as f64 / (k + 1) as f64;
            k += 1;
        }
        n += 1;
    }
    table
};

/// Halvings after which two roots that are still not distinguished count as a touch.
const MAX_HALVINGS: u32 = 40;

/// The first time in `(0, end]` at which a polynomial that is positive at 0 comes to zero; `None`
/// where it stays positive. A polynomial that is not positive at 0 is at its root there. Its
/// coefficients beyond its degree are zero, and `end` is at most 1.
pub(crate) fn first_root(polynomial: &[f64; ROOM], degree: usize, end: f64) -> Option<f64> {
    if polynomial[0] <= 0.0 {
        return Some(0.0);
    }
    if stays_positive(polynomial, end) {
        return None;
    }
    root_within(polynomial, degree, end)
}

/// The same of a polynomial that may come to zero. Apart, so that the others make no room for it.
#[inline(never)]
fn root_within(polynomial: &[f64; ROOM], degree: usize, end: f64) -> Option<f64> {
    let mut fall = [0.0; ROOM];
    for k in 1..ROOM {
        fall[k - 1] = -(k as f64) * polynomial[k];
    }
    let curve = Curve { polynomial, fall, end };
    if stays_positive(&curve.fall, end) {
        // It falls throughout, and so has one root or none.
        let (first, last) = (polynomial[0], value(polynomial, end));
        return (last < 0.0).then(|| curve.refine(0.0, end, end * (first / (first - last))));
    }
    let mut bernstein = [0.0; ROOM];
    let mut power = 1.0;
    for k in 0..=degree {
        bernstein[k] = polynomial[k] * power * INVERSE_BINOMIAL[degree][k];
        power *= end;
    }
    for level in 1..=degree {
        for k in (level..=degree).rev() {
            bernstein[k] += bernstein[k - 1];
        }
    }
    let whole = Interval {
        begin: 0.0,
        width: end,
        bernstein,
    };
    whole.first_root(&curve, degree, MAX_HALVINGS)
}

/// Whether the least value of the first three terms on `[0, end]` outweighs all negative ones after
/// them.
fn stays_positive(polynomial: &[f64; ROOM], end: f64) -> bool {
    let [first, b, c, ..] = *polynomial;
    let (b, c) = (b * end, c * (end * end));
    let bottom = if b < 0.0 && -b < 2.0 * c {
        first - 0.25 * b * b / c
    } else {
        first.min(first + b + c)
    };
    let mut negative = [0.0; ROOM];
    for k in 3..ROOM {
        negative[k] = if polynomial[k] < 0.0 { polynomial[k] } else { 0.0 };
    }
    bottom + value(&negative, end) > 0.0
}

/// Between which two places something ends that holds at `low` and not at `high`, after so many halvings.
#[inline]
pub(crate) fn halve(mut low: f64, mut high: f64, times: u32, holds: impl Fn(f64) -> bool) -> (f64, f64) {
    for _ in 0..times {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low, high)
}

/// The root between two places of a function that falls through zero there, by Newton's method from a guess: each
/// step that leaves the bracket is replaced by a bisection, so that 64 always suffice. `function` gives a value and
/// its slope; the root is found to `close`, which is the error of rounding: asking for less would chase noise.
pub(crate) fn falls_between(
    (from, to): (f64, f64),
    guess: f64,
    close: f64,
    function: impl Fn(f64) -> (f64, f64),
) -> f64 {
    let (mut above, mut below) = (from, to);
    let mut at = guess;
    for _ in 0..64 {
        let (there, slope) = function(at);
        if there > 0.0 {
            above = at;
        } else {
            below = at;
        }
        let newton = at - there / slope;
        if (newton - at).abs() <= close {
            return newton.max(from).min(to);
        }
        let next = if newton > above && newton < below {
            newton
        } else {
            0.5 * (above + below)
        };
        if next == at {
            return at;
        }
        at = next;
    }
    at
}

/// A polynomial up to a time, and how fast it falls.
struct Curve<'a> {
    polynomial: &'a [f64; ROOM],
    fall: [f64; ROOM],
    end: f64,
}

impl Curve<'_> {
    /// The root between two times, where it falls through zero, from a guess.
    fn refine(&self, from: f64, to: f64, guess: f64) -> f64 {
        falls_between((from, to), guess, 1e-15 * self.end, |at| {
            (value(self.polynomial, at), -value(&self.fall, at))
        })
    }
}

/// A part of the time, with the polynomial's Bernstein coefficients on it.
struct Interval {
    begin: f64,
    width: f64,
    bernstein: [f64; ROOM],
}

impl Interval {
    fn first_root(&self, curve: &Curve<'_>, degree: usize, halvings: u32) -> Option<f64> {
        let bernstein = &self.bernstein[..=degree];
        let changes = bernstein
            .windows(2)
            .filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0))
            .count();
        let passes = bernstein[degree] < 0.0;
        let refined = || {
            let (first, last) = (bernstein[0].max(0.0), bernstein[degree]);
            let guess = self.begin + self.width * (first / (first - last));
            curve.refine(self.begin, self.begin + self.width, guess)
        };
        match changes {
            0 => None,
            1 if passes => Some(refined()),
            _ if halvings == 0 => passes.then(refined),
            _ => {
                let (left, right) = self.halves(degree);
                left.first_root(curve, degree, halvings - 1)
                    .or_else(|| right.first_root(curve, degree, halvings - 1))
            }
        }
    }

    /// Both halves, by de Casteljau's construction.
    fn halves(&self, degree: usize) -> (Self, Self) {
        let mut right = self.bernstein;
        let mut left = [0.0; ROOM];
        left[0] = right[0];
        for (level, left) in left[1..=degree].iter_mut().enumerate() {
            for k in 0..degree - level {
                right[k] = 0.5 * (right[k] + right[k + 1]);
            }
            *left = right[0];
        }
        let width = 0.5 * self.width;
        let half = |begin: f64, bernstein| Self {
            begin,
            width,
            bernstein,
        };
        (half(self.begin, left), half(self.begin + width, right))
    }
}

/// Most evaluations of a function whose root is enclosed.
const MAX_EVALUATIONS: usize = 60;

/// Where a function comes to zero between `low` and `high`, at which it has opposite signs: by the
/// false position, with the Illinois rule against a side that stands still (Dowell and Jarratt
/// 1971). It ends where the function is within `close` of zero.
pub(crate) fn root_between(low: f64, high: f64, close: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (low, high);
    let (mut at_a, mut at_b) = (function(a), function(b));
    for _ in 0..MAX_EVALUATIONS {
        let guess = (a * at_b - b * at_a) / (at_b - at_a);
        // Rounding may put it outside, and two equal values nowhere.
        let middle = if guess > a.min(b) && guess < a.max(b) {
            guess
        } else {
            0.5 * (a + b)
        };
        let at_middle = function(middle);
        if at_middle.abs() <= close {
            return middle;
        }
        if (at_middle < 0.0) == (at_b < 0.0) {
            at_a *= 0.5;
        } else {
            (a, at_a) = (b, at_b);
        }
        (b, at_b) = (middle, at_middle);
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    fn padded(coefficients: &[f64]) -> [f64; ROOM] {
        let mut polynomial = [0.0; ROOM];
        polynomial[..coefficients.len()].copy_from_slice(coefficients);
        polynomial
    }

    /// The product of `(root - t)`, and of factors without a root, and its degree.
    fn with_roots(roots: &[f64], others: &[f64]) -> ([f64; ROOM], usize) {
        let multiply = |a: Vec<f64>, b: &[f64]| {
            let mut product = vec![0.0; a.len() + b.len() - 1];
            for (i, x) in a.iter().enumerate() {
                for (k, y) in b.iter().enumerate() {
                    product[i + k] += x * y;
                }
            }
            product
        };
        let mut polynomial = vec![1.0];
        for root in roots {
            polynomial = multiply(polynomial, &[*root, -1.0]);
        }
        for other in others {
            polynomial = multiply(polynomial, &[1.0 + other * other, -2.0 * other, 1.0]);
        }
        if polynomial[0] < 0.0 {
            polynomial.iter_mut().for_each(|term| *term = -*term);
        }
        (padded(&polynomial), polynomial.len() - 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_first_root_is_found_and_none_where_there_is_none(
            roots in prop::collection::vec(prop_oneof![0.01..1.5f64, -2.0..-0.01f64], 0..6),
            others in prop::collection::vec(-1.0..2.0f64, 0..5),
            end in 0.1..1.0f64,
        ) {
            let (polynomial, degree) = with_roots(&roots, &others);
            let first = roots.iter().copied().filter(|root| *root > 0.0).fold(f64::INFINITY, f64::min);
            let apart = roots.iter().all(|root| *root == first || (root - first).abs() > 1e-3);
            prop_assume!(apart && (first - end).abs() > 1e-3);
            match first_root(&polynomial, degree, end) {
                Some(root) => prop_assert!((root - first).abs() < 1e-9, "{root} for {first}"),
                None => prop_assert!(first > end, "none for {first}"),
            }
            prop_assert!(value(&polynomial, 0.0) > 0.0);
        }
    }

    #[test]
    fn a_touch_is_no_root_and_two_near_roots_are() {
        // (t - 1/2)^2 + gap.
        let dip = |gap: f64| first_root(&padded(&[0.25 + gap, -1.0, 1.0]), 2, 1.0);
        assert_eq!(dip(1e-13), None);
        let root = dip(-1e-12).expect("a root");
        assert!((root - (0.5 - 1e-6)).abs() < 1e-9, "{root}");
    }

    #[test]
    fn a_polynomial_that_begins_at_its_root_is_there() {
        assert_eq!(first_root(&padded(&[0.0, 1.0]), 1, 1.0), Some(0.0));
        assert_eq!(first_root(&padded(&[-1e-20, 1.0]), 1, 1.0), Some(0.0));
        assert_eq!(first_root(&padded(&[1.0]), 0, 1.0), None);
    }
}
