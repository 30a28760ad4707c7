//! The psychometric function of a two-alternative forced choice: how often the larger of two is named, by how much they
//! differ.
//!
//! `p(x) = 1/2 + (1/2 - lapse) Phi((x - threshold) / sigma)`: guessing gets half of the answers right, and a share of
//! up to 0.1 is wrong however large the difference (Wichmann and Hill 2001). The threshold is where the cumulative
//! Gaussian is at one half, so that 75 % of the answers are correct without lapses. The width is that between 5 % and
//! 95 % of the Gaussian, 3.29 sigma, as psignifit 4 has it (Schütt and others 2016).

mod bootstrap;
mod function;
mod likelihood;

pub use bootstrap::{Bootstrap, Resampling, bootstrap, bootstrap_clusters};
use function::WIDTHS;
pub use function::{GUESS, Level, MAX_LAPSE, Psychometric};

use super::StatsError;
use super::error::{check_count, check_finite};
use likelihood::best;

/// Levels below which three parameters cannot be found.
pub const MIN_LEVELS: usize = 3;

/// Answers joined by level, the lowest first.
#[must_use]
pub fn by_level(answers: impl IntoIterator<Item = (f64, bool)>) -> Vec<Level> {
    let mut answers: Vec<(f64, bool)> = answers.into_iter().collect();
    answers.sort_by(|a, b| a.0.total_cmp(&b.0));
    answers
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same| Level {
            level: same[0].0,
            trials: u32::try_from(same.len()).unwrap_or(u32::MAX),
            correct: u32::try_from(same.iter().filter(|(_, correct)| *correct).count()).unwrap_or(u32::MAX),
        })
        .collect()
}

/// The function of the largest likelihood.
///
/// # Errors
/// The answers do not determine it: there are fewer than three levels, all are correct or wrong, they do not get better
/// with the level, they jump from chance to the ceiling, or the threshold is at an end of the tested levels or beyond.
pub fn fit(levels: &[Level]) -> Result<Psychometric, StatsError> {
    check(levels)?;
    let found = best(levels, None);
    // Nothing is gained over the same share at every level.
    const GAIN: f64 = 1e-6;
    if flat_deviance(levels) - found.deviance < GAIN {
        return Err(no_rise());
    }
    let tested = levels.iter().filter(|level| level.trials > 0).map(|level| level.level);
    let (lowest, highest) = (
        tested.clone().fold(f64::MAX, f64::min),
        tested.clone().fold(f64::MIN, f64::max),
    );
    if found.width > 0.5 * WIDTHS[1] * (highest - lowest) {
        return Err(no_rise());
    }
    // Of answers that jump at an outermost level, none were given on its one side: the share at it tells on which side
    // the threshold is. Only what is above the highest level would tell lapses, which are then taken as none.
    const SAME: f64 = 1e-4;
    let (width, is_step) = (found.width, found.is_step(levels));
    if found.probability(lowest) >= found.probability(found.threshold) - SAME {
        // With as many errors at large differences as a function may have, lower levels would not help.
        return Err(if found.is_lapse_at_bound() {
            no_rise()
        } else {
            let why = format!("the threshold is at the lowest tested level, {lowest}, or below it");
            StatsError::new(why).with_advice("test lower levels")
        });
    }
    let is_low = is_step && found.probability(highest) <= 0.5 * (GUESS + 1.0) + SAME;
    if is_low || found.threshold >= highest {
        let why = format!("the threshold is at the highest tested level, {highest}, or above it");
        return Err(StatsError::new(why).with_advice("test higher levels"));
    }
    let is_within = |level: f64, distance: f64| (level - found.threshold).abs() < distance;
    let is_at_end = is_step && (is_within(lowest, width) || is_within(highest, width));
    if is_at_end || !tested.clone().any(|level| is_within(level, 0.5 * width)) {
        let (below, above): (Vec<f64>, Vec<f64>) = tested.partition(|level| *level <= found.threshold);
        let why = format!(
            "answers jump from about chance to the ceiling between the tested levels {} and {}",
            below.into_iter().fold(lowest, f64::max),
            above.into_iter().fold(highest, f64::min)
        );
        return Err(StatsError::new(why).with_advice("test levels between them"));
    }
    Ok(found)
}

fn check(levels: &[Level]) -> Result<(), StatsError> {
    check_finite("level", levels.iter().map(|level| level.level))?;
    if let Some(one) = levels.iter().find(|level| level.correct > level.trials) {
        let Level { level, trials, correct } = one;
        let why = format!("{correct} of {trials} answers are correct at level {level}");
        return Err(StatsError::new(why));
    }
    let mut tested: Vec<f64> = levels
        .iter()
        .filter(|level| level.trials > 0)
        .map(|level| level.level)
        .collect();
    tested.sort_by(f64::total_cmp);
    tested.dedup();
    check_count("levels", tested.len(), MIN_LEVELS)?;
    let trials: u32 = levels.iter().map(|level| level.trials).sum();
    match levels.iter().map(|level| level.correct).sum::<u32>() {
        0 => {
            let why = format!("all {trials} answers are wrong, where guessing gets half of them right");
            Err(StatsError::new(why).with_advice("check which answer counts as correct"))
        }
        correct if correct == trials => {
            let why = format!("all {trials} answers are correct: the threshold is below every level");
            Err(StatsError::new(why).with_advice("test smaller differences"))
        }
        _ => Ok(()),
    }
}

fn no_rise() -> StatsError {
    StatsError::new("answers do not get better with the level, so there is no threshold")
}

/// Deviance of the best constant share that the function can have.
fn flat_deviance(levels: &[Level]) -> f64 {
    let trials: f64 = levels.iter().map(|level| f64::from(level.trials)).sum();
    let correct: f64 = levels.iter().map(|level| f64::from(level.correct)).sum();
    let share = (correct / trials).clamp(GUESS, 1.0);
    levels
        .iter()
        .map(|level| likelihood::deviance(level, share, 1.0 - share))
        .sum()
}

#[cfg(test)]
mod tests;
