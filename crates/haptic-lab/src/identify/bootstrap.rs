//! Honest intervals by a parametric bootstrap with the encoder in it (Efron and Tibshirani 1993).
//!
//! The covariance of a least squares fit knows nothing of an encoder's steps, which are not noise: over a short stroke
//! they bend every regressor in the same way, and the fit is sure of what is wrong. So the fit itself is taken for the
//! truth, its motion is counted by the same encoder and its force drowned in noise of the residual's spectrum, again
//! and again, and each such record is fitted. How far those fits scatter is the interval; how far their mean is from
//! the truth that made them is the bias.

use super::options::Record;
use super::result::Interval;
use super::sensor::{counted, noise, samples_in};
use crate::stats::mean::{deviation, mean};
use fastrand::Rng;

/// Length of the pieces of the residual that keep their place and get a sign by chance (Wu 1986), s: longer than noise
/// remembers itself. So what a law lacks about a turn stays about a turn.
const PIECE_S: f64 = 0.5;
/// Student's t for 95 % and 60 fits.
const STUDENT_T: f64 = 2.001;

/// Drawn records know a part of a bias alone: their motion is the record's, which was smoothed before. Of LuGre's
/// Stribeck velocity and bristle damping with an encoder of 0.1 um, 3.0 and 1.0 times what they know is left.
const UNSEEN: f64 = 3.0;

/// What a fit says happened, to draw records from.
#[derive(Clone, Debug)]
pub(super) struct World {
    /// Motion and force that obey the fit exactly.
    pub(super) motion: Record,
    /// Step of the encoder, m.
    pub(super) resolution_m: f64,
    /// Root mean square of the force's white noise, N.
    pub(super) white_rms_n: f64,
    /// What the fit leaves of the force at each sample beyond white noise, N: slow noise, and what the law lacks.
    pub(super) residual_n: Vec<f64>,
    /// The share of it that the white noise does not explain.
    pub(super) share: f64,
}

impl World {
    /// A record of another day.
    pub(super) fn draw(&self, random: &mut Rng) -> Record {
        let samples = self.motion.t_s.len();
        let period_s = (self.motion.t_s[samples - 1] - self.motion.t_s[0]) / (samples - 1) as f64;
        let mut force_n = noise(random, self.white_rms_n, 0.0, samples);
        let piece = samples_in(PIECE_S, period_s).clamp(1, samples);
        for start in (0..samples).step_by(piece) {
            let share = if random.bool() { self.share } else { -self.share };
            for (force, left) in force_n[start..].iter_mut().zip(&self.residual_n[start..]).take(piece) {
                *force += share * left;
            }
        }
        for (force, truth) in force_n.iter_mut().zip(&self.motion.force_n) {
            *force += truth;
        }
        Record {
            t_s: self.motion.t_s.clone(),
            position_m: counted(random, &self.motion.position_m, self.resolution_m),
            velocity_mps: None,
            force_n,
            resolution_m: Some(self.resolution_m),
        }
    }
}

/// How the fits to records that were drawn scatter about the truth, parameter by parameter.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    /// Mean less truth.
    pub(super) bias: Vec<f64>,
    /// Standard deviation.
    pub(super) deviation: Vec<f64>,
    /// How many fits there were.
    pub(super) fits: usize,
}

impl Spread {
    /// Of the estimates that were made of `truth`; `None` where they are too few for a spread.
    pub(super) fn of(truth: &[f64], estimates: &[Vec<f64>]) -> Option<Self> {
        let fits = estimates.len();
        if fits < 10 {
            return None;
        }
        let (bias, deviation) = (0..truth.len())
            .map(|at| {
                let values: Vec<f64> = estimates.iter().map(|estimate| estimate[at]).collect();
                (mean(&values) - truth[at], deviation(&values))
            })
            .unzip();
        Some(Self { bias, deviation, fits })
    }

    /// The value without its bias, and its 95 % interval, with room for what is left of a bias that is no chance.
    pub(super) fn interval(&self, at: usize, value: f64) -> (f64, Interval) {
        let (bias, fits) = (self.bias[at], self.fits as f64);
        let corrected = value - bias;
        let sure = (bias.abs() - STUDENT_T * self.deviation[at] / fits.sqrt()).max(0.0);
        let half = STUDENT_T * self.deviation[at] * (1.0 + 1.0 / fits).sqrt() + UNSEEN * sure;
        (corrected, [corrected - half, corrected + half])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_is_the_textbooks() {
        // The mean of 100 numbers of deviation 2 has the deviation 0.2.
        let mut random = Rng::with_seed(3);
        let estimates: Vec<Vec<f64>> = (0..2000)
            .map(|_| vec![5.3 + noise(&mut random, 2.0, 0.0, 100).iter().sum::<f64>() / 100.0])
            .collect();
        let spread = Spread::of(&[5.0], &estimates).expect("enough fits");
        let (corrected, [low, high]) = spread.interval(0, 5.0);
        assert!(
            (spread.bias[0] - 0.3).abs() < 0.02 && (corrected - 4.7).abs() < 0.02,
            "{spread:?}"
        );
        let half = 0.400 + UNSEEN * (spread.bias[0] - 0.4 / 2000.0_f64.sqrt());
        assert!(((high - low) / 2.0 - half).abs() < 0.02, "{low} {high}");
    }

    #[test]
    fn a_drawn_record_is_the_motion_counted_and_drowned() {
        let t_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
        let world = World {
            motion: Record {
                position_m: t_s.clone(),
                force_n: vec![1.0; 2000],
                t_s,
                ..Record::default()
            },
            resolution_m: 1e-5,
            white_rms_n: 0.0,
            residual_n: vec![0.2; 2000],
            share: 0.5,
        };
        let record = world.draw(&mut Rng::with_seed(5));
        assert!(
            record
                .force_n
                .iter()
                .all(|force| ((force - 1.0).abs() - 0.1).abs() < 1e-12)
        );
        assert!(
            record
                .position_m
                .iter()
                .zip(&world.motion.position_m)
                .all(|(x, truth)| (x - truth).abs() < 1.6e-5)
        );
    }
}
