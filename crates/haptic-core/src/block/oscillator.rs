//! The linear oscillator between two contact events: `M y'' + C y' + K y = f0 + g1 t`.
//!
//! Everything follows from its impulse response `h`, which solves `h'' + 2 sigma h' + omega^2 h =
//! 0`, `h(0) = 0`, `h'(0) = 1`, and from the integrals `H1` of `h` and `H2` of `H1`:
//!
//! ```text
//! y(t)  = w0 h  + (f0 H1 + g1 H2) / M
//! y'(t) = w0 h' + (f0 h  + g1 H1) / M
//! y''(t) = a0 h' + beta h      with a0 = f0/M - 2 sigma w0,  beta = g1/M - omega^2 w0
//! ```
//!
//! The acceleration is homogeneous in `h` and `h'`, so the times at which it vanishes are
//! closed-form.
//!
//! Its response to an impulse with the integrals is closed-form for two real roots too; the response
//! over a tick is kept from tick to tick.

use crate::math::{atan2, exp, exp_m1, flush, ln_1p, sin_cos, sqrt};
use crate::series::RECIPROCAL;
use crate::snapshot::Archive;
use core::f64::consts::PI;

/// Initial state and load of a motion, in the coordinate in which the block slides forwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InitialState {
    /// Velocity at the start, m/s.
    pub(super) w0: f64,
    /// Net force at the start less damping, N.
    pub(super) f0: f64,
    /// Slope of that force, N/s.
    pub(super) g1: f64,
}

#[derive(Clone, Copy, Debug)]
enum Damping {
    Under {
        omega_d: f64,
    },
    /// Overdamped or critical: the two real roots, `fast <= slow <= 0`, and half their distance.
    Over {
        slow: f64,
        fast: f64,
        half_gap: f64,
    },
}

/// A mass on a spring and a damper.
#[derive(Clone, Copy, Debug)]
pub(super) struct Oscillator {
    inverse_mass: f64,
    sigma: f64,
    omega_squared: f64,
    /// max(omega, 2 sigma): how fast the Taylor series of `h` grows.
    fastest: f64,
    /// Half a turn of the free oscillation, s; infinite where it does not turn.
    half_turn_s: f64,
    damping: Damping,
}

/// The Taylor series is used up to this value of `fastest * t`; above it the closed forms lose at
/// most three digits to cancellation.
const TAYLOR_LIMIT: f64 = 1.0;

/// Two roots count as nearly equal up to this value of half their distance times `t`. It is small
/// against `TAYLOR_LIMIT / 2`, so that omega is never small where the near-critical form divides by
/// its square.
const NEAR_CRITICAL_LIMIT: f64 = 0.25;

/// Up to this value of `fastest * delta` five terms of the series are exact to 1e-16: the sixth is
/// `z^5 8/720`.
const NEAR_LIMIT: f64 = 2e-3;

/// Up to this value of `fastest * delta` the first order is exact to 1e-16.
const FIRST_ORDER_LIMIT: f64 = 1e-8;

impl Oscillator {
    /// Mass kg (> 0), total damping `B + b` N s/m (>= 0), stiffness N/m (>= 0).
    pub(super) fn new(mass: f64, damping: f64, stiffness: f64) -> Self {
        let sigma = damping / (2.0 * mass);
        let omega_squared = stiffness / mass;
        // (omega - sigma)(omega + sigma) keeps the digits that omega^2 - sigma^2 would lose near
        // critical damping.
        let omega = sqrt(omega_squared);
        let gap_squared = (omega - sigma) * (omega + sigma);
        let damping = if gap_squared > 0.0 {
            Damping::Under {
                omega_d: sqrt(gap_squared),
            }
        } else {
            let half_gap = sqrt(-gap_squared);
            let fast = -(sigma + half_gap);
            // The product of the roots is omega^2; a difference would cancel.
            let slow = if fast == 0.0 { 0.0 } else { omega_squared / fast };
            Damping::Over { slow, fast, half_gap }
        };
        Self {
            inverse_mass: 1.0 / mass,
            sigma,
            omega_squared,
            fastest: omega.max(2.0 * sigma),
            half_turn_s: match damping {
                Damping::Under { omega_d } => PI / omega_d,
                Damping::Over { .. } => f64::INFINITY,
            },
            damping,
        }
    }

    /// Half-turns of the free oscillation in `t` seconds: as many extrema of the velocity can lie
    /// there.
    pub(super) fn half_turns(&self, t: f64) -> f64 {
        t / self.half_turn_s
    }

    /// A time, s, cut to a number of half-turns.
    pub(super) fn within_half_turns(&self, time_s: f64, half_turns: f64) -> f64 {
        time_s.min(half_turns * self.half_turn_s)
    }

    /// Whether the velocity has one extremum at most in `t` seconds.
    pub(super) fn turns_once_at_most(&self, t: f64) -> bool {
        t < self.half_turn_s
    }

    /// `h`, `h'`, `H1`, `H2` at `t >= 0`.
    pub(super) fn response(&self, t: f64) -> Response {
        let z = self.fastest * t;
        if z < TAYLOR_LIMIT {
            return self.taylor(t, z);
        }
        match self.damping {
            Damping::Under { omega_d } => self.oscillating(t, omega_d),
            Damping::Over { slow, fast, half_gap } => {
                if half_gap * t < NEAR_CRITICAL_LIMIT {
                    // Nearly equal roots: their divided difference would cancel.
                    self.near_critical(t, -half_gap * half_gap)
                } else {
                    overdamped(t, slow, fast, half_gap)
                }
            }
        }
    }

    /// The response `delta` seconds after the time of `known`, where that is so little that five
    /// terms of a series reach it: the jitter of a timer, not a missed tick.
    pub(super) fn response_near(&self, known: &Response, delta: f64) -> Option<Response> {
        if self.fastest * delta.abs() > NEAR_LIMIT {
            return None;
        }
        let two_sigma = 2.0 * self.sigma;
        if self.fastest * delta.abs() < FIRST_ORDER_LIMIT {
            // Not the timer's jitter, but the rounding of a time that was a difference.
            let Response { h, dh, h1, h2 } = *known;
            return Some(Response {
                h: h + delta * dh,
                dh: dh - delta * (two_sigma * dh + self.omega_squared * h),
                h1: h1 + delta * h,
                h2: h2 + delta * h1,
            });
        }
        // From h(T), h'(T) the free motion continues with c and s, which solve the same equation with
        // c(0) = 1, c'(0) = 0 and s(0) = 0, s'(0) = 1: s is h itself and c = h' + 2 sigma h.
        let (a, b) = (-2.0 * self.sigma * delta, -self.omega_squared * delta * delta);
        let t2 = a / 2.0;
        let t3 = (a * t2 + b / 2.0) / 3.0;
        let t4 = (a * t3 + b * t2 / 3.0) / 4.0;
        let t5 = (a * t4 + b * t3 / 4.0) / 5.0;
        let s = delta * (1.0 + t2 + t3 + t4 + t5);
        let ds = 1.0 + 2.0 * t2 + 3.0 * t3 + 4.0 * t4 + 5.0 * t5;
        let s1 = delta * delta * (1.0 / 2.0 + t2 / 3.0 + t3 / 4.0 + t4 / 5.0 + t5 / 6.0);
        let s2 = delta * delta * delta * (1.0 / 6.0 + t2 / 12.0 + t3 / 20.0 + t4 / 30.0 + t5 / 42.0);
        let (c, c1, c2) = (ds + two_sigma * s, s + two_sigma * s1, s1 + two_sigma * s2);
        let Response { h, dh, h1, h2 } = *known;
        Some(Response {
            h: h * c + dh * s,
            dh: dh * ds - self.omega_squared * h * s,
            h1: h1 + h * c1 + dh * s1,
            h2: h2 + delta * h1 + h * c2 + dh * s2,
        })
    }

    /// Power series of `h` in `t`: n (n-1) c_n = -2 sigma (n-1) c_(n-1) - omega^2 c_(n-2).
    ///
    /// Term n is at most t z^(n-1) Fibonacci(n) / n!, which fixes how many are needed for 1e-17.
    fn taylor(&self, t: f64, z: f64) -> Response {
        let last = match z {
            z if z < 0.02 => 7,
            z if z < 0.1 => 10,
            z if z < 0.25 => 14,
            z if z < 0.5 => 18,
            _ => 22,
        };
        let damping = -2.0 * self.sigma * t;
        let spring = -self.omega_squared * t * t;
        let (mut before, mut term) = (0.0, 1.0); // c_n t^(n-1)
        let (mut h, mut dh, mut h1, mut h2) = (1.0, 1.0, 0.5, 1.0 / 6.0);
        for n in 2..=last {
            let next = (damping * term + spring * before * RECIPROCAL[n - 1]) * RECIPROCAL[n];
            before = term;
            term = next;
            h += term;
            dh += n as f64 * term;
            let integrated = term * RECIPROCAL[n + 1];
            h1 += integrated;
            h2 += integrated * RECIPROCAL[n + 2];
        }
        Response {
            h: t * h,
            dh,
            h1: t * t * h1,
            h2: t * t * t * h2,
        }
    }

    fn oscillating(&self, t: f64, omega_d: f64) -> Response {
        let phase = omega_d * t;
        if phase < NEAR_CRITICAL_LIMIT {
            return self.near_critical(t, omega_d * omega_d);
        }
        let decay = flush(exp(-self.sigma * t));
        let (sin, cos) = sin_cos(phase);
        let h = decay * sin / omega_d;
        let dh = decay * cos - self.sigma * h;
        self.integrate(t, h, dh)
    }

    /// h = e^(-sigma t) S, h' = e^(-sigma t) (c - sigma S), with c = cos and S = sin/omega_d as
    /// series in `gap = omega^2 - sigma^2`, of either sign.
    fn near_critical(&self, t: f64, gap: f64) -> Response {
        let q = -gap * t * t;
        let (mut cosine, mut sine) = (1.0, 1.0);
        let (mut c_term, mut s_term) = (1.0, 1.0);
        // |q| < 0.07: six terms reach 1e-18.
        for n in 1..7 {
            c_term *= q * RECIPROCAL[2 * n - 1] * RECIPROCAL[2 * n];
            s_term *= q * RECIPROCAL[2 * n] * RECIPROCAL[2 * n + 1];
            cosine += c_term;
            sine += s_term;
        }
        let decay = flush(exp(-self.sigma * t));
        let h = decay * t * sine;
        let dh = decay * cosine - self.sigma * h;
        self.integrate(t, h, dh)
    }

    /// `H1` and `H2` from the differential equation, integrated once and twice.
    fn integrate(&self, t: f64, h: f64, dh: f64) -> Response {
        let h1 = (1.0 - dh - 2.0 * self.sigma * h) / self.omega_squared;
        let h2 = (t - h - 2.0 * self.sigma * h1) / self.omega_squared;
        Response { h, dh, h1, h2 }
    }

    /// Displacement and velocity of `motion`, given the response at its time.
    pub(super) fn advance(&self, motion: &InitialState, r: &Response) -> (f64, f64) {
        (
            motion.w0 * r.h + (motion.f0 * r.h1 + motion.g1 * r.h2) * self.inverse_mass,
            motion.w0 * r.dh + (motion.f0 * r.h + motion.g1 * r.h1) * self.inverse_mass,
        )
    }

    /// Velocity and acceleration at `t`.
    pub(super) fn velocity(&self, motion: &InitialState, t: f64) -> (f64, f64) {
        let r = self.response(t);
        let (a0, beta) = self.acceleration(motion);
        (self.advance(motion, &r).1, a0 * r.dh + beta * r.h)
    }

    /// The coefficients of the acceleration: `a(t) = a0 h'(t) + beta h(t)`.
    pub(super) fn acceleration(&self, motion: &InitialState) -> (f64, f64) {
        (
            motion.f0 * self.inverse_mass - 2.0 * self.sigma * motion.w0,
            motion.g1 * self.inverse_mass - self.omega_squared * motion.w0,
        )
    }

    /// The first `t > 0` at which the acceleration vanishes, infinity if there is none, and the
    /// distance from one such time to the next.
    pub(super) fn extrema(&self, motion: &InitialState) -> (f64, f64) {
        let (a0, beta) = self.acceleration(motion);
        match self.damping {
            Damping::Under { omega_d } => {
                let half_turn = self.half_turn_s;
                // An acceleration that starts at zero starts at an extremum: the next is half a
                // turn on.
                if a0 == 0.0 {
                    return (half_turn, half_turn);
                }
                let mut phase = atan2(a0 * omega_d, self.sigma * a0 - beta);
                if phase <= 0.0 {
                    phase += PI;
                }
                (phase / omega_d, half_turn)
            }
            Damping::Over { slow, fast, half_gap } => {
                // a(t) ~ A e^(slow t) - B e^(fast t) with A = beta + a0 slow, B = beta + a0 fast.
                let a = beta + a0 * slow;
                let first = if half_gap == 0.0 {
                    -a0 / (beta + a0 * fast)
                } else {
                    let ratio = -2.0 * a0 * half_gap / a;
                    if ratio > 0.0 {
                        ln_1p(ratio) / (2.0 * half_gap)
                    } else {
                        f64::INFINITY
                    }
                };
                (if first > 0.0 { first } else { f64::INFINITY }, f64::INFINITY)
            }
        }
    }
}

/// `h`, `h'` and the two integrals of `h` at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Response {
    pub(super) h: f64,
    pub(super) dh: f64,
    pub(super) h1: f64,
    pub(super) h2: f64,
}

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

/// The response for the tick length met last: a steady tick finds it here.
#[derive(Clone, Copy, Debug)]
pub(super) struct Propagator {
    cached_for: f64,
    cached: Response,
}

impl Propagator {
    pub(super) fn new(oscillator: &Oscillator) -> Self {
        Self {
            cached_for: 0.0,
            cached: oscillator.response(0.0),
        }
    }

    /// Forgets the tick before: what it then gives depends on nothing that was.
    pub(super) fn rest(&mut self, oscillator: &Oscillator) {
        if self.cached_for != 0.0 {
            *self = Self::new(oscillator);
        }
    }

    /// Saves or loads for which tick it is kept; the response follows from that.
    pub(super) fn archive(&mut self, name: &'static str, oscillator: &Oscillator, archive: &mut Archive<'_>) {
        archive.number(name, &mut self.cached_for);
        if archive.is_loading() {
            self.cached = oscillator.response(self.cached_for);
        }
    }

    /// The response at `t`: the one kept where the tick is as long as the last, one derived from it
    /// where it nearly is.
    #[inline]
    pub(super) fn at(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        #[expect(clippy::float_cmp, reason = "a cache key: the same number or not")]
        if t == self.cached_for {
            return self.cached;
        }
        self.at_another(oscillator, t)
    }

    /// Apart, so that a tick on time saves no registers for it.
    #[cold]
    fn at_another(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        if let Some(nearby) = oscillator.response_near(&self.cached, t - self.cached_for) {
            return nearby;
        }
        self.cached = oscillator.response(t);
        self.cached_for = t;
        self.cached
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Classical Runge-Kutta on h, h', H1, H2 with many steps: slow, and independent of every
    /// closed form.
    fn by_integration(sigma: f64, omega_squared: f64, t: f64) -> Response {
        let rate = |y: [f64; 4]| [y[1], -2.0 * sigma * y[1] - omega_squared * y[0], y[0], y[2]];
        let steps = 20_000;
        let dt = t / f64::from(steps);
        let mut y = [0.0, 1.0, 0.0, 0.0];
        let shifted = |y: [f64; 4], k: [f64; 4], by: f64| core::array::from_fn(|i| y[i] + by * k[i]);
        for _ in 0..steps {
            let k1 = rate(y);
            let k2 = rate(shifted(y, k1, dt / 2.0));
            let k3 = rate(shifted(y, k2, dt / 2.0));
            let k4 = rate(shifted(y, k3, dt));
            for i in 0..4 {
                y[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        Response {
            h: y[0],
            dh: y[1],
            h1: y[2],
            h2: y[3],
        }
    }

    #[test]
    fn every_regime_agrees_with_numerical_integration() {
        let t = 1e-3;
        // sigma T and omega T on both sides of each border, critical damping, K = 0 and B = 0.
        for sigma_t in [0.0, 0.01, 0.2, 0.26, 0.6, 1.0, 3.0, 10.0] {
            for omega_t in [0.0, 0.05, 0.3, 0.51, 0.6, 0.999, 1.0, 1.001, 3.0, 9.0] {
                if sigma_t == 0.0 && omega_t == 0.0 {
                    continue;
                }
                let (sigma, omega) = (sigma_t / t, omega_t / t);
                let oscillator = Oscillator::new(1.0, 2.0 * sigma, omega * omega);
                let got = oscillator.response(t);
                let want = by_integration(sigma, omega * omega, t);
                for (name, got, want, scale) in [
                    ("h", got.h, want.h, t),
                    ("h'", got.dh, want.dh, 1.0),
                    ("H1", got.h1, want.h1, want.h1),
                    ("H2", got.h2, want.h2, want.h2),
                ] {
                    let error = (got - want).abs() / scale.abs();
                    assert!(
                        error < 2e-12,
                        "{name} at sigma T = {sigma_t}, omega T = {omega_t}: {got} for {want}, off by {error:.1e}"
                    );
                }
            }
        }
    }
}
