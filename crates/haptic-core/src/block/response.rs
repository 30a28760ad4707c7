//! The impulse response of an oscillator and its integrals, and their closed form for two real
//! roots.

use crate::flush::flush;
use crate::math::{exp, exp_m1};

/// `h`, `h'` and the two integrals of `h` at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Response {
    pub(super) h: f64,
    pub(super) dh: f64,
    pub(super) h1: f64,
    pub(super) h2: f64,
}

/// `1/n`, so that the series divides nothing.
pub(super) const RECIPROCAL: [f64; 25] = {
    let mut table = [0.0; 25];
    let mut n = 1;
    while n < 25 {
        table[n] = 1.0 / n as f64;
        n += 1;
    }
    table
};

/// Two real roots, far apart: divided differences of phi_n, where phi_1(z) = (e^z - 1)/z and so on.
pub(super) fn overdamped(t: f64, slow: f64, fast: f64, half_gap: f64) -> Response {
    let gap = 2.0 * half_gap;
    let (slow_t, fast_t) = (slow * t, fast * t);
    let (e_slow, e_fast) = (flush(exp(slow_t)), flush(exp(fast_t)));
    let (p_slow, p_fast) = (phi1(slow_t), phi1(fast_t));
    Response {
        h: (e_slow - e_fast) / gap,
        dh: (slow * e_slow - fast * e_fast) / gap,
        h1: t * (p_slow - p_fast) / gap,
        h2: t * t * (phi2(slow_t, p_slow) - phi2(fast_t, p_fast)) / gap,
    }
}

/// (e^z - 1) / z.
fn phi1(z: f64) -> f64 {
    if z == 0.0 { 1.0 } else { exp_m1(z) / z }
}

/// (e^z - 1 - z) / z^2.
fn phi2(z: f64, phi1: f64) -> f64 {
    if z.abs() > 0.5 {
        return (phi1 - 1.0) / z;
    }
    // 1/2 + z/6 + z^2/24 + ...: sixteen terms reach 1e-18 at |z| = 0.5.
    let (mut sum, mut term) = (0.5, 0.5);
    for reciprocal in &RECIPROCAL[3..19] {
        term *= z * reciprocal;
        sum += term;
    }
    sum
}
