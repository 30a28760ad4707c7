//! A hand against a sampled spring and damper: how much damping takes up all that sampling creates?
//!
//! The force is `-(K p + B (p - p[-1])/T)` of a sample, with the velocity of two samples. A hand
//! gets most out of it for the least speed where it goes straight from sample to sample, and from
//! one change of force to the next. Over motions of one frequency, a turn of `theta` a period, the
//! damping that takes up as much is the greater eigenvalue of
//!
//! ```text
//!           |     r w(d + 3/2)         sqrt(r (1 - r)) w(d + 1) |           hr sin n theta - hi cos n theta
//! b(theta) = |                                                   | T,  w(n) = -------------------------------
//!           | sqrt(r (1 - r)) w(d + 1)    (1 - r) w(d + 1/2)    |                   2 sin theta/2
//! ```
//!
//! with the delay of `d` whole periods and a share `r`, `hr = K + B/T (1 - cos theta)` and
//! `hi = B/T sin theta`. Without delay that is `K T/2 - B cos theta`, and `K T/2 + B` at its
//! greatest: the bound of Colgate and Schenkel 1997.

use super::Sampled;
use crate::math::{sin_cos, sqrt};
use core::f64::consts::PI;

/// Frequencies looked at for each turn of the delay, up to half the rate of the samples.
const PER_TURN: u32 = 32;

/// Narrowings of the interval around the greatest of them.
const NARROWINGS: u32 = 30;

impl Sampled {
    /// The damping, N s/m, that takes up all that a spring (N/m) and a damper (N s/m) give out.
    pub(in crate::adviser) fn damping_needed(&self, stiffness: f64, damping: f64) -> f64 {
        let steps = PER_TURN * (2 + u32::try_from(self.whole).unwrap_or(u32::MAX));
        let step = PI / f64::from(steps);
        let needed = |theta: f64| self.needed_at(theta, stiffness, damping);
        let angle = |k: u32| step * f64::from(k).max(1e-3);
        let (mut most, mut best) = (0.0, 0);
        for k in 0..=steps {
            let here = needed(angle(k));
            if here > most {
                (most, best) = (here, k);
            }
        }
        let (mut low, mut high) = (angle(best.saturating_sub(1)), angle((best + 1).min(steps)));
        for _ in 0..NARROWINGS {
            let third = (high - low) / 3.0;
            let (left, right) = (needed(low + third), needed(high - third));
            most = f64::max(most, f64::max(left, right));
            if left < right {
                low += third;
            } else {
                high -= third;
            }
        }
        most
    }

    /// The same for motions that turn by `theta`, rad, a period.
    fn needed_at(&self, theta: f64, stiffness: f64, damping: f64) -> f64 {
        let Self { period_s, whole, share } = *self;
        let (sine, cosine) = sin_cos(theta);
        let per_step = damping / period_s;
        let (hr, hi) = (stiffness + per_step * (1.0 - cosine), per_step * sine);
        let twice = 2.0 * sin_cos(0.5 * theta).0;
        let w = |n: f64| {
            let (sine, cosine) = sin_cos(n * theta);
            (hr * sine - hi * cosine) / twice
        };
        let whole = whole as f64;
        let (a, c) = (share * w(whole + 1.5), (1.0 - share) * w(whole + 0.5));
        let between = w(whole + 1.0);
        let apart = sqrt((a - c) * (a - c) + 4.0 * share * (1.0 - share) * between * between);
        0.5 * period_s * (a + c + apart)
    }

    /// The damping that takes up what a spring alone gives out, over its stiffness, s: half a period
    /// and the delay, and a little more where a force comes between two samples.
    pub(in crate::adviser) fn lateness_s(&self) -> f64 {
        let mean = self.whole as f64 + self.share + 0.5;
        0.5 * self.period_s * (mean + sqrt(mean * mean + self.share * (1.0 - self.share)))
    }
}
