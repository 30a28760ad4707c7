//! The alpha-beta-gamma filter: a tracker of position, velocity and acceleration with fading
//! memory.
//!
//! Gains from one number `r`, the share of the past that each sample leaves (Brookner, "Tracking
//! and Kalman Filtering Made Easy", 1998, the critically damped filter): `alpha = 1 - r^3`, `beta =
//! 1.5 (1 - r)^2 (1 + r)`, `gamma = (1 - r)^3`. It follows a constant acceleration without lag, and
//! tames the steps of an encoder.

use crate::math::{flush, powf};
use crate::snapshot::Archive;

/// Estimates velocity from positions at irregular times.
///
/// The memory is one of time, not of samples: a sample that comes early counts for less, one that
/// comes late for more. With gains fixed to samples, an encoder step seen a microsecond after the
/// last sample would read as metres a second.
#[derive(Clone, Copy, Debug)]
pub struct AlphaBetaGamma {
    period_s: f64,
    usual: Gains,
    position: f64,
    velocity: f64,
    acceleration: f64,
    started: bool,
}

#[derive(Clone, Copy, Debug)]
struct Gains {
    alpha: f64,
    beta: f64,
    gamma: f64,
}

impl Gains {
    fn new(memory: f64) -> Self {
        let fresh = 1.0 - memory;
        Self {
            alpha: 1.0 - memory * memory * memory,
            beta: 1.5 * fresh * fresh * (1.0 + memory),
            gamma: fresh * fresh * fresh,
        }
    }
}

/// Memory of the default filter, from the comparison of estimators on a 10 um encoder at 1 kHz.
pub const DEFAULT_MEMORY: f64 = 0.6;

/// A sample that comes off its time by less than this share of the period is on time.
const ON_TIME: f64 = 0.05;

/// Where less than this share of the past is left, there is no past: after 45 periods without a
/// sample, with the default memory.
const FORGOTTEN: f64 = 1e-10;

/// Below this speed, m/s, a filter at rest is at rest: counting is far coarser.
const AT_REST_MPS: f64 = 1e-15;

impl AlphaBetaGamma {
    /// The filter for samples every `period_s` seconds (> 0).
    #[must_use]
    pub fn new(period_s: f64) -> Self {
        Self {
            period_s,
            usual: Gains::new(DEFAULT_MEMORY),
            position: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            started: false,
        }
    }

    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.flag("has_sample", &mut self.started);
        archive.number("tracked_m", &mut self.position);
        archive.number("tracked_mps", &mut self.velocity);
        archive.number("tracked_mps2", &mut self.acceleration);
    }

    /// Forgets the past: the next sample is at rest.
    pub fn reset(&mut self) {
        self.started = false;
    }

    /// Takes the position (m) measured `elapsed_s` seconds after the one before; returns the
    /// velocity, m/s.
    #[inline(always)]
    pub fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
        if !self.started {
            self.position = position;
            self.velocity = 0.0;
            self.acceleration = 0.0;
            self.started = true;
            return 0.0;
        }
        if elapsed_s <= 0.0 {
            return self.velocity;
        }
        let periods = elapsed_s / self.period_s;
        let Gains { alpha, beta, gamma } = if (periods - 1.0).abs() < ON_TIME {
            self.usual
        } else {
            let left = powf(DEFAULT_MEMORY, periods);
            if left < FORGOTTEN {
                // What the past foretells over such a time has nothing to do with what came.
                self.velocity = (position - self.position) / elapsed_s;
                self.acceleration = 0.0;
                self.position = position;
                return self.velocity;
            }
            Gains::new(left)
        };
        let predicted = self.position + elapsed_s * (self.velocity + 0.5 * elapsed_s * self.acceleration);
        let residual = position - predicted;
        self.position = flush(predicted + alpha * residual);
        self.velocity += elapsed_s * self.acceleration + beta / elapsed_s * residual;
        self.acceleration += gamma / (elapsed_s * elapsed_s) * residual;
        if self.velocity.abs() < AT_REST_MPS && residual.abs() < AT_REST_MPS * elapsed_s {
            self.velocity = 0.0;
            self.acceleration = 0.0;
        }
        self.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_after_long_gap_is_the_mean_over_the_gap() {
        let mut filter = AlphaBetaGamma::new(1e-3);
        // To and fro at 0.5 Hz, and then nothing for ten seconds: five turns later the hand is
        // where it was.
        let at = |t: f64| 0.03 * crate::math::sin_cos(core::f64::consts::PI * t).0;
        for k in 0..1300 {
            filter.update(1e-3, at(f64::from(k) * 1e-3));
        }
        let velocity = filter.update(10.0, at(11.3));
        assert!(velocity.abs() < 0.01, "{velocity} m/s");
    }

    #[test]
    fn an_encoder_step_seen_too_early_is_no_speed() {
        for early_s in [1e-9, 1e-6, 1e-5, 1e-4, 5e-4] {
            let mut filter = AlphaBetaGamma::new(1e-3);
            for _ in 0..10 {
                filter.update(1e-3, 0.0);
            }
            let mut worst = filter.update(early_s, 1e-5).abs();
            for _ in 0..20 {
                worst = worst.max(filter.update(1e-3, 1e-5).abs());
            }
            // One count a period is 10 mm/s.
            assert!(worst < 10e-3, "{early_s} s early: {worst} m/s");
        }
    }

    #[test]
    fn constant_acceleration_has_no_lag_over_missed_samples_either() {
        let mut filter = AlphaBetaGamma::new(1e-3);
        let (mut t, mut estimate) = (0.0, 0.0);
        for k in 0..300 {
            let elapsed = if k % 50 == 49 { 37e-3 } else { 1e-3 };
            t += elapsed;
            estimate = filter.update(elapsed, 2.0 * t * t);
        }
        assert!((estimate - 4.0 * t).abs() < 1e-6, "{estimate} for {}", 4.0 * t);
    }
}
