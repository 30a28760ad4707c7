//! The difference to the sample before: no lag to speak of, and all of the encoder's noise.

use crate::snapshot::Archive;

/// Estimates velocity as the difference of two positions over the time between them.
#[derive(Clone, Copy, Debug, Default)]
pub struct FiniteDifference {
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

    /// Forgets the past: the next sample is at rest.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes the position (m) measured `elapsed_s` seconds after the one before; returns the
    /// velocity, m/s.
    pub fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
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
