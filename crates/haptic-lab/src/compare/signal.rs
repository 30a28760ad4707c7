//! A record at even times, with the velocity and acceleration of its positions.

use super::{CompareError, Side};
use crate::gaps::in_gaps;
use crate::identify::Record;
use crate::motion::{between, places};
use crate::smoothing::{HALF_WINDOW_S, encoder_step, less_inertia, velocity};
use haptic_motion::median::extent;

/// Shortest record, s.
pub(super) const MIN_S: f64 = 1.0;

/// Least extent of the positions of a motion, in steps of the encoder.
const MIN_STEPS: f64 = 10.0;

/// A record at even times.
#[derive(Clone, Debug)]
pub(super) struct Signal {
    pub(super) start_s: f64,
    pub(super) period_s: f64,
    /// Step of the encoder, m; 0 without one.
    pub(super) step_m: f64,
    pub(super) position_m: Vec<f64>,
    pub(super) velocity_mps: Vec<f64>,
    pub(super) force_n: Vec<f64>,
    /// Force, less inertia where the mass is known, N.
    pub(super) friction_n: Vec<f64>,
    /// Whether it says nothing of the surface: it lies in a gap of the record, or its velocity reaches into one.
    pub(super) is_in_gap: Vec<bool>,
}

impl Signal {
    /// The record at times `period_s` apart, for a mass, kg, if it is known.
    ///
    /// # Errors
    /// It is too short, or holds no motion.
    pub(super) fn new(record: &Record, period_s: f64, mass_kg: Option<f64>, side: Side) -> Result<Self, CompareError> {
        let (start_s, end_s) = match (record.t_s.first(), record.t_s.last()) {
            (Some(first), Some(last)) => (*first, *last),
            _ => (0.0, 0.0),
        };
        if end_s - start_s < MIN_S {
            let length_s = end_s - start_s;
            return Err(CompareError(format!(
                "the {side} record holds {length_s:.2} s; at least {MIN_S} s are needed"
            )));
        }
        #[expect(clippy::cast_sign_loss, reason = "a count of samples")]
        let count = ((end_s - start_s) / period_s) as usize + 1;
        let times = |index| start_s + period_s * index as f64;
        let position_m = resampled(&record.t_s, &record.position_m, (0..count).map(times));
        let force_n = resampled(&record.t_s, &record.force_n, (0..count).map(times));
        let step_m = record
            .resolution_m
            .or_else(|| encoder_step(&record.position_m))
            .unwrap_or(0.0);
        let (low, high) = extent(position_m.iter().copied());
        if high - low < MIN_STEPS * step_m || high == low {
            let (span_um, step_um) = ((high - low) * 1e6, step_m * 1e6);
            return Err(CompareError(format!(
                "the {side} record holds no motion: its positions span {span_um:.1} um, its encoder's step is \
                 {step_um:.1} um"
            )));
        }
        Ok(Self {
            is_in_gap: in_gaps(&record.t_s, (0..count).map(times), HALF_WINDOW_S.max(2.0 * period_s)),
            start_s,
            period_s,
            step_m,
            velocity_mps: velocity(&position_m, period_s),
            friction_n: mass_kg.map_or_else(
                || force_n.clone(),
                |mass_kg| less_inertia(&force_n, &position_m, mass_kg, period_s),
            ),
            position_m,
            force_n,
        })
    }

    pub(super) fn len(&self) -> usize {
        self.position_m.len()
    }

    pub(super) fn length_s(&self) -> f64 {
        self.period_s * self.len().saturating_sub(1) as f64
    }

    pub(super) fn time_s(&self, index: usize) -> f64 {
        self.start_s + self.period_s * index as f64
    }

    /// Least and greatest velocity, m/s.
    pub(super) fn velocities(&self) -> (f64, f64) {
        extent(self.outside_gaps(&self.velocity_mps))
    }

    /// The values that do not lie in gaps.
    pub(super) fn outside_gaps(&self, values: &[f64]) -> impl Iterator<Item = f64> {
        let each = values.iter().zip(&self.is_in_gap);
        each.filter(|(_, is_in_gap)| !**is_in_gap).map(|(value, _)| *value)
    }

    /// Samples in so much time, at least one.
    #[expect(clippy::cast_sign_loss, reason = "a count of samples")]
    pub(super) fn samples_in(&self, time_s: f64) -> usize {
        ((time_s / self.period_s).round() as usize).max(1)
    }

    /// The part from `from_s` on over `count` samples, at times of its own between the samples.
    pub(super) fn part(&self, from_s: f64, count: usize) -> Self {
        let times = || (0..count).map(|index| from_s + self.period_s * index as f64);
        let cut = |values: &[f64]| times().map(|t_s| self.value_at(values, t_s)).collect();
        let is_in_gap = |t_s| {
            let (before, _) = self.place(t_s);
            self.is_in_gap[before..(before + 2).min(self.len())].contains(&true)
        };
        Self {
            start_s: from_s,
            position_m: cut(&self.position_m),
            velocity_mps: cut(&self.velocity_mps),
            force_n: cut(&self.force_n),
            friction_n: cut(&self.friction_n),
            is_in_gap: times().map(is_in_gap).collect(),
            ..*self
        }
    }

    /// The sample before a time, and the share of the interval to the next one.
    fn place(&self, t_s: f64) -> (usize, f64) {
        let place = ((t_s - self.start_s) / self.period_s).clamp(0.0, (self.len() - 1) as f64);
        #[expect(clippy::cast_sign_loss, reason = "it lies within the samples")]
        let before = (place as usize).min(self.len().saturating_sub(2));
        (before, place - before as f64)
    }

    /// A value between two samples, by a straight line.
    pub(super) fn value_at(&self, values: &[f64], t_s: f64) -> f64 {
        let (before, share) = self.place(t_s);
        values[before] + share * (values[(before + 1).min(self.len() - 1)] - values[before])
    }

    /// Values of the signal, as means over `2 half + 1` samples.
    pub(super) fn mean_of(&self, values: &[f64], half: usize) -> Vec<f64> {
        (0..self.len())
            .map(|index| {
                let part = &values[index.saturating_sub(half)..(index + half + 1).min(self.len())];
                part.iter().sum::<f64>() / part.len() as f64
            })
            .collect()
    }

    /// Velocity, position and friction by sample, without those that `is_in_gap` marks.
    pub(super) fn course(&self, is_in_gap: &[bool]) -> Vec<[f64; 3]> {
        (0..self.len())
            .filter(|index| !is_in_gap[*index])
            .map(|index| [self.velocity_mps[index], self.position_m[index], self.friction_n[index]])
            .collect()
    }
}

/// Values at other times, by straight lines.
fn resampled(t_s: &[f64], values: &[f64], times: impl Iterator<Item = f64>) -> Vec<f64> {
    places(t_s, times).map(|place| between(values, place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_that_is_short_or_at_rest_is_refused() {
        let record = |count: u32, position: fn(f64) -> f64| Record {
            t_s: (0..count).map(|k| f64::from(k) * 1e-3).collect(),
            position_m: (0..count)
                .map(|k| (position(f64::from(k) * 1e-3) / 1e-5).round() * 1e-5)
                .collect(),
            force_n: vec![0.0; count as usize],
            ..Record::default()
        };
        let refused = |record: &Record| {
            Signal::new(record, 1e-3, None, Side::Real)
                .expect_err("refused")
                .to_string()
        };
        assert!(refused(&record(0, |t| t)).contains("0.00 s"));
        assert!(refused(&record(900, |t| t)).contains("0.90 s; at least 1 s"));
        assert!(refused(&record(2000, |_| 0.3)).contains("no motion"));
        let jitter = refused(&record(2000, |t| 2e-5 * (60.0 * t).sin()));
        assert!(
            jitter.contains("span 40.0 um") && jitter.contains("step is 10.0 um"),
            "{jitter}"
        );
    }
}
