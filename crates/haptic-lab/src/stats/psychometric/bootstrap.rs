//! How sure a fit is: answers are drawn again, fitted again, and the fits' scatter is the interval (Efron and
//! Tibshirani 1993; Wichmann and Hill 2001, part II). Drawn answers that jump between two levels are fitted by any
//! threshold between them, and their fits scatter too little: the interval also holds every threshold that the answers
//! themselves do not exclude (the profile likelihood, Venzon and Moolgavkar 1988).

use super::function::{Level, Psychometric, WIDTHS};
use super::likelihood::{Held, best, best_of, span};
use crate::stats::CONFIDENCE;
use crate::stats::mean::{quantile, student_t};
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

/// The 95 % intervals of a fit: percentiles of the fits to drawn answers, and what the answers do not exclude.
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

/// Draws answers and fits them, `draws` times (at least 1). The same seed gives the same intervals. Absent where the
/// answers do not bound threshold and width: they jump at a level, or chance explains that they rise.
#[must_use]
pub fn bootstrap(
    levels: &[Level],
    fit: &Psychometric,
    resampling: Resampling,
    draws: usize,
    seed: u64,
) -> Option<Bootstrap> {
    if fit.is_step(levels) {
        return None;
    }
    let threshold = not_excluded(levels, fit, Held::Threshold)?;
    let width = not_excluded(levels, fit, Held::Width)?;
    let shares: Vec<f64> = levels
        .iter()
        .map(|level| match resampling {
            Resampling::Parametric => fit.probability(level.level),
            Resampling::Nonparametric => f64::from(level.correct) / f64::from(level.trials.max(1)),
        })
        .collect();
    let fits = fits(fit, draws, seed, |random| {
        let drawn = levels.iter().zip(&shares).map(|(level, share)| Level {
            correct: (0..level.trials).map(|_| u32::from(random.f64() < *share)).sum(),
            ..*level
        });
        drawn.collect()
    });
    let worse = fits.iter().filter(|one| one.deviance >= fit.deviance).count();
    let worse_fits = worse as f64 / fits.len() as f64;
    let joined = |[low, high]: [f64; 2], [least, most]: [f64; 2]| [low.min(least), high.max(most)];
    let threshold = joined(percentiles(&fits, |one| one.threshold), threshold);
    Some(Bootstrap {
        threshold_interval: threshold.map(|end| end.max(floor(levels))),
        width_interval: joined(percentiles(&fits, |one| one.width), width),
        worse_fits,
        draws: fits.len(),
    })
}

/// The intervals of a fit to the answers of several subjects, the levels of each: subjects are drawn, as those who
/// answered are a few of many. They are no narrower than those of answers that are all independent, which
/// [`Resampling::Parametric`] gives, as it does for a single subject.
///
/// Few subjects differ less among themselves than among many: the percentiles' distances from the fit grow by
/// `sqrt(n / (n - 1))`, and by Student's t over that of many subjects (Hesterberg 2015).
#[must_use]
pub fn bootstrap_clusters(subjects: &[Vec<Level>], fit: &Psychometric, draws: usize, seed: u64) -> Option<Bootstrap> {
    let levels = joined(subjects);
    let alone = bootstrap(&levels, fit, Resampling::Parametric, draws, seed)?;
    if subjects.len() < 2 {
        return Some(alone);
    }
    let fits = fits(fit, draws, seed, |random| {
        joined(subjects.iter().map(|_| &subjects[random.usize(..subjects.len())]))
    });
    let count = subjects.len() as f64;
    let growth = student_t(count - 1.0) / student_t(MANY) * (count / (count - 1.0)).sqrt();
    let wider = |[low, high]: [f64; 2], of: fn(&Psychometric) -> f64, floor: f64| {
        let [least, most] = percentiles(&fits, of).map(|end| of(fit) + growth * (end - of(fit)));
        [low.min(least).max(floor), high.max(most)]
    };
    Some(Bootstrap {
        threshold_interval: wider(alone.threshold_interval, |one| one.threshold, floor(&levels)),
        width_interval: wider(alone.width_interval, |one| one.width, 0.0),
        ..alone
    })
}

/// Degrees of freedom at which Student's t is that of a normal distribution.
const MANY: f64 = 1e6;

/// The fits to drawn answers.
fn fits(
    fit: &Psychometric,
    draws: usize,
    seed: u64,
    mut drawn: impl FnMut(&mut Rng) -> Vec<Level>,
) -> Vec<Psychometric> {
    let mut random = Rng::with_seed(seed);
    let draws = 0..draws.max(1);
    draws.map(|_| best(&drawn(&mut random), Some(fit))).collect()
}

/// Ends of the share of [`CONFIDENCE`] in the middle.
fn percentiles(fits: &[Psychometric], of: fn(&Psychometric) -> f64) -> [f64; 2] {
    let mut values: Vec<f64> = fits.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    [0.5 * (1.0 - CONFIDENCE), 0.5 * (1.0 + CONFIDENCE)].map(|share| quantile(&values, share))
}

/// The values of a parameter with which the answers are not so much less likely, whatever the others are, that chance
/// does not explain it. Absent where they have no end.
fn not_excluded(levels: &[Level], fit: &Psychometric, held: Held) -> Option<[f64; 2]> {
    /// What the deviance of the truth exceeds the least one by in 5 % of all answers (chi squared of one degree).
    const CHANCE: f64 = 3.841;
    /// How far from the fit to look: every 1/16 extent of the levels, and then ever farther. Of a width the distance is
    /// that of the logarithms.
    const NEAR: i32 = 24;
    const FAR: [f64; 6] = [2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
    let [_, extent] = span(levels);
    let value = |away: f64| match held {
        Held::Threshold => fit.threshold + away * extent,
        Held::Width => (fit.width * away.exp()).max(WIDTHS[0] * extent),
    };
    let is_likely = |away: f64| best_of(levels, held, value(away)).deviance < fit.deviance + CHANCE;
    let end = |side: f64| {
        let near = (0..=NEAR).map(|step| f64::from(step) / 16.0);
        let places: Vec<f64> = near.chain(FAR).map(|away| side * away).collect();
        let last = places.iter().rposition(|away| is_likely(*away)).unwrap_or(0);
        // A jump is a width as good as any: only its upper end is an end.
        let Some(beyond) = places.get(last + 1) else {
            return (held == Held::Width && side < 0.0).then(|| value(places[last]));
        };
        let (mut inside, mut outside) = (places[last], *beyond);
        for _ in 0..12 {
            let middle = 0.5 * (inside + outside);
            *(if is_likely(middle) { &mut inside } else { &mut outside }) = middle;
        }
        Some(value(inside))
    };
    Some([end(-1.0)?, end(1.0)?])
}

/// What a threshold is not below: zero, where no level is.
fn floor(levels: &[Level]) -> f64 {
    levels.iter().map(|level| level.level).fold(0.0, f64::min)
}

/// The answers of several subjects together, the lowest level first.
pub(super) fn joined<'a>(subjects: impl IntoIterator<Item = &'a Vec<Level>>) -> Vec<Level> {
    let mut levels: Vec<Level> = subjects.into_iter().flatten().copied().collect();
    levels.sort_by(|a, b| a.level.total_cmp(&b.level));
    let together = levels.chunk_by(|a, b| a.level == b.level).map(|same| Level {
        level: same[0].level,
        trials: same.iter().map(|one| one.trials).sum(),
        correct: same.iter().map(|one| one.correct).sum(),
    });
    together.collect()
}
