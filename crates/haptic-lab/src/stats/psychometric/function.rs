//! The function itself, its bounds, and the answers at the levels that it is fitted to.

use serde::Serialize;
use statrs::function::erf::erfc;

/// Share of correct answers by guessing among two.
pub const GUESS: f64 = 0.5;
/// Largest share of lapses (Wichmann and Hill 2001 take 0.06; psignifit's prior ends at 0.1).
pub const MAX_LAPSE: f64 = 0.1;
/// What the width may be, as shares of the extent of the levels: within it answers that jump, or do not get better, run
/// into a wall instead of away.
pub(super) const WIDTHS: [f64; 2] = [1e-3, 1e3];
/// Standard deviations between 5 % and 95 % of a normal distribution.
pub(super) const DEVIATIONS_IN_WIDTH: f64 = 3.289_707_253_902_945;

/// The answers at one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// How much the two differ.
    pub level: f64,
    /// How often that was asked.
    pub trials: u32,
    /// How often the answer was correct.
    pub correct: u32,
}

/// A fitted function. Threshold and width have the unit of the levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Psychometric {
    /// Where the Gaussian is at one half.
    pub threshold: f64,
    /// From its 5 % to its 95 %.
    pub width: f64,
    /// Share of lapses.
    pub lapse: f64,
    /// Twice the log-likelihood ratio to a model with a parameter for each level: how badly it fits.
    pub deviance: f64,
}

impl Psychometric {
    /// Whether the answers go from chance to the ceiling within a level: any narrower function would do as well, so
    /// that neither width nor threshold is determined.
    #[must_use]
    pub fn is_step(&self, levels: &[Level]) -> bool {
        let tested = levels.iter().filter(|level| level.trials > 0);
        tested
            .filter(|level| (level.level - self.threshold).abs() < self.width)
            .count()
            < 2
    }

    /// Whether more answers are wrong at large differences than [`MAX_LAPSE`] allows.
    #[must_use]
    pub fn is_lapse_at_bound(&self) -> bool {
        self.lapse > MAX_LAPSE - 1e-6
    }

    /// Probability of a correct answer at a level.
    #[must_use]
    pub fn probability(&self, level: f64) -> f64 {
        let z = DEVIATIONS_IN_WIDTH * (level - self.threshold) / self.width;
        GUESS + (1.0 - GUESS - self.lapse) * normal_cdf(z)
    }
}

/// The share of a standard normal distribution below z.
pub(super) fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}
