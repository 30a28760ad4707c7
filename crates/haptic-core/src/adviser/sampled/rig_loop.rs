//! A rig against a stuck block, as a loop: when does it oscillate by itself?
//!
//! The rig is a mass on its own damping, `m p'' = f - b p'`. At each sample the force is
//! `-(K p + B p')`, of the true velocity: an estimator that lags takes stability away, as delay
//! does. From one sample to the next the motion is solved exactly,
//!
//! ```text
//! s+ = A s + g0 f[k-d] + g1 f[k-d-1],   A = [1 a; 0 c],   s = (p, p')
//! ```
//!
//! where the older force acts for a share of the period and the newer one for the rest. The loop is
//! stable where all roots of its characteristic polynomial
//!
//! ```text
//! z^(d+1) (z - 1) (z - c) + z n0(z) + n1(z),   n(z) = K (z - c) gp + (K a + B (z - 1)) gv
//! ```
//!
//! lie inside the unit circle (Schur 1918, Cohn 1922). Towards infinite mass that is
//! `K < 2 (b + B) / (T + 2 tau)`.

use super::{MAX_PERIODS, Sampled};
use crate::math::exp;
use crate::series::halve;

/// Coefficients of the longest polynomial.
const MAX_COEFFICIENTS: usize = MAX_PERIODS + 4;

/// Halvings of an interval that holds a bound.
const HALVINGS: u32 = 60;

/// Doublings in which a bound is met, or there is none.
const DOUBLINGS: u32 = 60;

/// Places between nothing and the greatest damping that are looked at for one that fits a
/// stiffness.
const PLACES: u32 = 64;

/// How the rig answers a force, or its own velocity, over a time.
#[derive(Clone, Copy, Debug, Default)]
struct Answer {
    /// Displacement by a force, m/N.
    place: f64,
    /// Velocity by a force, m/s/N.
    velocity: f64,
}

/// A rig in a sampled loop.
#[derive(Clone, Copy, Debug)]
pub(in crate::adviser) struct RigLoop {
    whole: usize,
    /// m/T, N s/m: the damping that stops the rig in a period.
    stopping: f64,
    /// Displacement over a period by a velocity at its start, s.
    coasting_s: f64,
    /// Share of a velocity that is left after a period.
    left: f64,
    newer: Answer,
    older: Answer,
}

impl RigLoop {
    /// `mass` is the rig's, kg (> 0), and `damping` its own, N s/m.
    pub(in crate::adviser) fn new(mass: f64, damping: f64, times: Sampled) -> Self {
        let Sampled { period_s, whole, share } = times;
        let answer = |time_s: f64| {
            let (first, second) = means(damping * time_s / mass);
            Answer {
                place: time_s * time_s * second / mass,
                velocity: time_s * first / mass,
            }
        };
        let (all, newer) = (answer(period_s), answer(period_s * (1.0 - share)));
        Self {
            whole,
            stopping: mass / period_s,
            coasting_s: all.velocity * mass,
            left: 1.0 - damping * all.velocity,
            newer,
            older: Answer {
                place: all.place - newer.place,
                velocity: all.velocity - newer.velocity,
            },
        }
    }

    /// Whether a motion against a spring (N/m, > 0) and a damper (N s/m) dies away.
    fn is_stable(&self, stiffness: f64, damping: f64) -> bool {
        let mut polynomial = [0.0; MAX_COEFFICIENTS];
        let degree = self.whole + 3;
        polynomial[degree] = 1.0;
        polynomial[degree - 1] = -(1.0 + self.left);
        polynomial[degree - 2] = self.left;
        for (answer, power) in [(self.newer, 1), (self.older, 0)] {
            let Answer { place, velocity } = answer;
            polynomial[power + 1] += stiffness * place + damping * velocity;
            polynomial[power] += stiffness * (self.coasting_s * velocity - self.left * place) - damping * velocity;
        }
        all_roots_inside(&mut polynomial[..=degree])
    }

    /// Whether a velocity dies away against a damper alone, N s/m: the same without the root of the
    /// place.
    fn stops(&self, damping: f64) -> bool {
        let mut polynomial = [0.0; MAX_COEFFICIENTS];
        let degree = self.whole + 2;
        polynomial[degree] = 1.0;
        polynomial[degree - 1] = -self.left;
        polynomial[1] += damping * self.newer.velocity;
        polynomial[0] += damping * self.older.velocity;
        all_roots_inside(&mut polynomial[..=degree])
    }

    /// The damping, N s/m, from which on no stiffness is stable.
    pub(in crate::adviser) fn greatest_damping(&self) -> f64 {
        greatest(self.stopping, |damping| self.stops(damping))
    }

    /// The stiffness, N/m, from which on the loop oscillates with such a damping, N s/m: 0 where it
    /// does with any.
    pub(in crate::adviser) fn greatest_stiffness(&self, damping: f64) -> f64 {
        if !self.stops(damping) {
            return 0.0;
        }
        greatest(self.stopping / self.coasting_s, |stiffness| {
            self.is_stable(stiffness, damping)
        })
    }

    /// Whether the loop does not oscillate with such a grip, N/m and N s/m.
    pub(in crate::adviser) fn holds(&self, stiffness: f64, damping: f64) -> bool {
        if stiffness > 0.0 {
            self.is_stable(stiffness, damping)
        } else {
            self.stops(damping)
        }
    }

    /// The greatest damping, N s/m and below `most`, with which a stiffness (N/m) is stable.
    pub(in crate::adviser) fn greatest_damping_for(&self, stiffness: f64, most: f64) -> Option<f64> {
        let stable = |damping: f64| self.holds(stiffness, damping);
        let place = |k: u32| most * f64::from(k) / f64::from(PLACES);
        let below = (0..PLACES).rev().find(|k| stable(place(*k)))?;
        Some(halve(place(below), place(below + 1), HALVINGS, stable).0)
    }
}

/// `(1 - e^-q)/q` and `(q - 1 + e^-q)/q^2`: what is left of a velocity in the mean of a time, and of
/// that in the mean again.
fn means(q: f64) -> (f64, f64) {
    if q < 1.0 {
        // The series of the second: 1/2 - q/6 + q^2/24 - ...
        let (mut term, mut second, mut n) = (0.5, 0.5, 2.0);
        for _ in 0..20 {
            n += 1.0;
            term *= -q / n;
            second += term;
        }
        return (1.0 - q * second, second);
    }
    let first = (1.0 - exp(-q)) / q;
    (first, (1.0 - first) / q)
}

/// The greatest value up to which something holds that holds next to zero; `guess` has its size.
fn greatest(guess: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, guess);
    for _ in 0..DOUBLINGS {
        if !holds(high) {
            return halve(low, high, HALVINGS, holds).0;
        }
        (low, high) = (high, 2.0 * high);
    }
    f64::INFINITY
}

/// Whether every root of a polynomial, its lowest coefficient first, lies inside the unit circle:
/// each step takes one root away, and its reflection coefficient must be below 1.
fn all_roots_inside(polynomial: &mut [f64]) -> bool {
    let mut rest = polynomial;
    while let [lowest, .., highest] = rest {
        let reflection = *lowest / *highest;
        if reflection.is_nan() || reflection.abs() >= 1.0 {
            return false;
        }
        let last = rest.len() - 1;
        for i in 0..=last / 2 {
            let (a, b) = (rest[i], rest[last - i]);
            rest[i] = a - reflection * b;
            rest[last - i] = b - reflection * a;
        }
        rest = &mut rest[1..];
    }
    true
}
