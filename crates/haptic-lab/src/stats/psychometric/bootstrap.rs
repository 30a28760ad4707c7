//! How sure a fit is: answers are drawn again, fitted again, and the fits' scatter is the interval (Efron and
//! Tibshirani 1993; Wichmann and Hill 2001, part II).

use super::function::{Level, Psychometric};
use super::likelihood::best;
use crate::stats::CONFIDENCE;
use crate::stats::mean::quantile;
use fastrand::Rng;
use serde::Serialize;

/// Where the probabilities of the drawn answers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resampling {
    /// The fitted function.
    Parametric,
    /// The shares that were seen.
    Nonparametric,
}

/// The 95 % intervals of a fit, from percentiles of the fits to drawn answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bootstrap {
    /// Interval of the threshold, in the unit of the levels. Where no level is below zero it does not go below zero.
    pub threshold_interval: [f64; 2],
    /// Interval of the width, in the unit of the levels.
    pub width_interval: [f64; 2],
    /// The share of drawn answers that fit as badly as the true ones, or worse. A small one says that the function is
    /// not that of the subject. It means little where answers are drawn from the shares that were seen.
    pub worse_fits: f64,
    /// How many times answers were drawn.
    pub draws: usize,
}

/// Draws answers and fits them, `draws` times (at least 1). The same seed gives the same intervals.
#[must_use]
pub fn bootstrap(levels: &[Level], fit: &Psychometric, resampling: Resampling, draws: usize, seed: u64) -> Bootstrap {
    let mut random = Rng::with_seed(seed);
    let draws = draws.max(1);
    let shares: Vec<f64> = levels
        .iter()
        .map(|level| match resampling {
            Resampling::Parametric => fit.probability(level.level),
            Resampling::Nonparametric => f64::from(level.correct) / f64::from(level.trials.max(1)),
        })
        .collect();
    let fits: Vec<Psychometric> = (0..draws)
        .map(|_| {
            let drawn: Vec<Level> = levels
                .iter()
                .zip(&shares)
                .map(|(level, share)| Level {
                    correct: (0..level.trials).map(|_| u32::from(random.f64() < *share)).sum(),
                    ..*level
                })
                .collect();
            best(&drawn, Some(fit))
        })
        .collect();
    let interval = |of: fn(&Psychometric) -> f64| {
        let mut values: Vec<f64> = fits.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        [0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)].map(|share| quantile(&values, share))
    };
    let floor = levels.iter().map(|level| level.level).fold(0.0, f64::min);
    let [low, high] = interval(|one| one.threshold);
    let worse = fits.iter().filter(|one| one.deviance >= fit.deviance).count();
    #[expect(clippy::cast_precision_loss, reason = "a count of draws")]
    let worse_fits = worse as f64 / draws as f64;
    Bootstrap {
        threshold_interval: [low.max(floor), high.max(floor)],
        width_interval: interval(|one| one.width),
        worse_fits,
        draws,
    }
}
