//! The difference to the sample before: no lag to speak of, and all of the encoder's noise. And the same behind a
//! first-order low-pass: less noise, and a lag of `1 / (2 pi cutoff)` seconds.

use crate::math::{exp_m1, flush};
use crate::snapshot::Archive;
use core::f64::consts::TAU;

/// Estimates velocity as the difference of two positions over the time between them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FiniteDifference {
    last: Option<f64>,
    velocity: f64,
}

impl FiniteDifference {
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.option("has_sample", &mut self.last, 0.0, |archive, last| {
            archive.number("sample_m", last);
        });
        archive.number("slope_mps", &mut self.velocity);
    }

    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    pub(super) fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
        let Some(last) = self.last else {
            self.last = Some(position);
            return 0.0;
        };
        if elapsed_s > 0.0 {
            self.velocity = (position - last) / elapsed_s;
            self.last = Some(position);
        }
        self.velocity
    }
}

/// Cutoff of the default filter, Hz.
pub(super) const DEFAULT_CUTOFF_HZ: f64 = 100.0;

/// Estimates velocity as a smoothed finite difference.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowPass {
    difference: FiniteDifference,
    rate: f64,
    velocity: f64,
}

impl LowPass {
    /// `cutoff_hz` (Hz, > 0) is where the filter has taken away 3 dB.
    pub(super) fn new(cutoff_hz: f64) -> Self {
        Self {
            difference: FiniteDifference::default(),
            rate: TAU * cutoff_hz,
            velocity: 0.0,
        }
    }

    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        self.difference.archive(archive);
        archive.number("filtered_mps", &mut self.velocity);
    }

    pub(super) fn reset(&mut self) {
        self.difference.reset();
        self.velocity = 0.0;
    }

    pub(super) fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
        let raw = self.difference.update(elapsed_s, position);
        // The exact response to a velocity held since the last sample, so that an early sample
        // counts for less.
        let nearer = -exp_m1(-self.rate * elapsed_s.max(0.0)) * (raw - self.velocity);
        self.velocity = flush(self.velocity + nearer);
        self.velocity
    }
}
