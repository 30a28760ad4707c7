//! The force of a motor that repeats itself along the travel, from slow sweeps to and fro.
//!
//! ```text
//! F = level(direction) + sum of a_k cos(k p) + b_k sin(k p),   p = 2 pi x / period
//! ```
//!
//! What friction takes changes its sign with the direction of motion, and cogging does not: both
//! directions over the same positions separate them. What the mass takes is subtracted, by the second
//! difference of the positions. Forces are averaged in bins of the position, by direction; the period
//! is the one whose harmonics leave the least.
#![expect(clippy::cast_sign_loss, reason = "some hundred bins and steps")]

use super::result::Interval;
use crate::robust_fit::NORMAL_95;
use haptic_core::rig_friction::{COGGING_HARMONICS, Cogging, Harmonic};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Bins over the travel of the sweep.
const BINS: usize = 400;

/// Smallest pivot of a normal matrix that can be solved: its entries are counts of bins.
const MIN_PIVOT: f64 = 1e-9;

/// Fewest samples of a bin that counts.
const MIN_SAMPLES: usize = 3;

/// Fewest bins with samples.
const MIN_BINS: usize = 60;

/// Fewest bins in a period, and fewest periods in the travel: what is finer or longer is not seen.
const BINS_A_PERIOD: f64 = 10.0;
const MIN_PERIODS: f64 = 1.5;

/// Steps of the search in one turn over the whole travel.
const STEPS_A_TURN: f64 = 8.0;

/// A period that is a whole fraction of another one is taken if it leaves at most this much more.
const NEARLY_AS_GOOD: f64 = 1.1;

/// Amplitude of the first harmonic over its standard error, from which on there is cogging.
const SURE: f64 = 6.0;

/// Share of the scatter of the bins that cogging must explain.
const MIN_EXPLAINED: f64 = 0.5;

/// Share of a sweep's speed from which on its reference counts as at speed.
const AT_SPEED: f64 = 0.99;

/// Distance in time of the positions whose second difference is the acceleration, s: longer, it would
/// miss the shortest periods; shorter, the encoder's steps would count for more.
const DIFFERENCE_S: f64 = 0.03;

/// Coefficients beside the harmonics: a level for each direction.
const LEVELS: usize = 2;
const COEFFICIENTS: usize = LEVELS + 2 * COGGING_HARMONICS;

/// What was found of cogging.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundCogging {
    /// Period and harmonics; the phase is that of the positions of the record.
    pub cogging: Cogging,
    /// Amplitude of the strongest harmonic, N, and its 95 % interval.
    pub amplitude_n: f64,
    /// 95 % interval of the amplitude, N.
    pub amplitude_interval_n: Interval,
    /// Root mean square of the force by position that is left, N.
    pub residual_rms_n: f64,
}

/// A sample of a sweep, where its reference goes at its speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SweepSample {
    /// Position, m.
    pub position_m: f64,
    /// Direction of the reference, 1 or -1.
    pub direction: f64,
    /// Force that drives the handle, N.
    pub force_n: f64,
    /// Acceleration of the handle, m/s^2.
    pub acceleration_mps2: f64,
}

/// The samples of a sweep at which its reference goes at its speed: position (m), velocity of the
/// reference (m/s) and force (N) of ticks that are `period_s` seconds apart.
#[must_use]
pub fn at_speed(ticks: &[(f64, f64, f64)], period_s: f64) -> Vec<SweepSample> {
    let fastest = ticks.iter().map(|tick| tick.1.abs()).fold(0.0, f64::max);
    let reach = ((DIFFERENCE_S / period_s).round() as usize).max(1);
    let span_s = reach as f64 * period_s;
    ticks
        .windows(2 * reach + 1)
        .filter(|window| window[reach].1.abs() > AT_SPEED * fastest)
        .map(|window| {
            let (position_m, velocity_mps, force_n) = window[reach];
            let (before_m, after_m) = (window[0].0, window[2 * reach].0);
            SweepSample {
                position_m,
                direction: velocity_mps.signum(),
                force_n,
                acceleration_mps2: (after_m - 2.0 * position_m + before_m) / span_s.powi(2),
            }
        })
        .collect()
}

/// The cogging in a sweep to and fro, of a mass, kg.
///
/// # Errors
/// Why there is none to be seen, with the figures.
pub fn cogging(samples: &[SweepSample], mass_kg: f64) -> Result<FoundCogging, String> {
    let (bins, travel_m) = binned(samples, mass_kg);
    if bins.len() < MIN_BINS {
        return Err(format!(
            "the sweep covers {} places, and {MIN_BINS} are needed",
            bins.len()
        ));
    }
    let scatter = fit(&bins, f64::INFINITY)
        .map(|levels| levels.left)
        .ok_or("the forces of the sweep are alike everywhere")?;
    let most_turns = bins.len() as f64 / LEVELS as f64 / BINS_A_PERIOD;
    let steps = ((most_turns - MIN_PERIODS) * STEPS_A_TURN).max(0.0) as usize;
    let turns = |step: usize| MIN_PERIODS + step as f64 / STEPS_A_TURN;
    let left = |turns: f64| fit(&bins, travel_m / turns).map_or(f64::INFINITY, |fitted| fitted.left);
    let best = (0..=steps)
        .map(turns)
        .min_by(|a, b| left(*a).total_cmp(&left(*b)))
        .ok_or("the sweep is too short for any period")?;
    // A fit with harmonics is as good at a multiple of the period.
    let shortest = (2..=COGGING_HARMONICS)
        .rev()
        .map(|divisor| refined(best * divisor as f64, left))
        .find(|turns| *turns <= most_turns && left(*turns) <= NEARLY_AS_GOOD * left(best));
    let turns = refined(shortest.unwrap_or(best), left);
    let period_m = travel_m / turns;
    let fitted = fit(&bins, period_m).ok_or("the sweep's positions do not separate the harmonics")?;
    let freedom = (bins.len() - COEFFICIENTS) as f64;
    let variance = fitted.left / freedom;
    let harmonics: [Harmonic; COGGING_HARMONICS] = std::array::from_fn(|k| Harmonic {
        cosine: fitted.coefficients[LEVELS + 2 * k],
        sine: fitted.coefficients[LEVELS + 2 * k + 1],
    });
    let amplitude = |k: usize| f64::hypot(harmonics[k].cosine, harmonics[k].sine);
    let strongest = (0..COGGING_HARMONICS)
        .max_by(|a, b| amplitude(*a).total_cmp(&amplitude(*b)))
        .unwrap_or(0);
    let amplitude_n = amplitude(strongest);
    let error_n =
        (variance * fitted.spread[LEVELS + 2 * strongest].max(fitted.spread[LEVELS + 2 * strongest + 1])).sqrt();
    let explained = 1.0 - fitted.left / scatter;
    if amplitude_n < SURE * error_n || explained < MIN_EXPLAINED {
        return Err(format!(
            "no force repeats itself along the way: the best amplitude is {amplitude_n:.3} N and explains {:.0} % of \
             the scatter by position, {:.3} N",
            100.0 * explained.max(0.0),
            (scatter / bins.len() as f64).sqrt()
        ));
    }
    Ok(FoundCogging {
        cogging: Cogging {
            period_m,
            absolute_position: false,
            harmonics,
        },
        amplitude_n,
        amplitude_interval_n: [
            (amplitude_n - NORMAL_95 * error_n).max(0.0),
            amplitude_n + NORMAL_95 * error_n,
        ],
        residual_rms_n: variance.sqrt(),
    })
}

/// The mean force at a place, by direction.
#[derive(Clone, Copy, Debug)]
struct Bin {
    position_m: f64,
    /// 0 for the positive direction, 1 for the negative.
    direction: usize,
    force_n: f64,
}

/// The bins with samples, and the travel that they cover, m.
fn binned(samples: &[SweepSample], mass_kg: f64) -> (Vec<Bin>, f64) {
    let least = samples
        .iter()
        .map(|sample| sample.position_m)
        .fold(f64::INFINITY, f64::min);
    let greatest = samples
        .iter()
        .map(|sample| sample.position_m)
        .fold(f64::NEG_INFINITY, f64::max);
    let travel_m = greatest - least;
    if travel_m.is_nan() || travel_m <= 0.0 {
        return (Vec::new(), 0.0);
    }
    let mut sums = vec![[(0.0, 0.0, 0_usize); 2]; BINS];
    for sample in samples {
        let index = (((sample.position_m - least) / travel_m * BINS as f64) as usize).min(BINS - 1);
        let sum = &mut sums[index][usize::from(sample.direction < 0.0)];
        let force_n = sample.force_n - mass_kg * sample.acceleration_mps2;
        *sum = (sum.0 + sample.position_m, sum.1 + force_n, sum.2 + 1);
    }
    let mut bins = Vec::new();
    for both in sums {
        for (direction, (position, force, count)) in both.into_iter().enumerate() {
            if count >= MIN_SAMPLES {
                bins.push(Bin {
                    position_m: position / count as f64,
                    direction,
                    force_n: force / count as f64,
                });
            }
        }
    }
    (bins, travel_m)
}

/// A place near `turns` that leaves the least.
fn refined(turns: f64, left: impl Fn(f64) -> f64) -> f64 {
    let (mut from, mut to) = (turns - 1.0 / STEPS_A_TURN, turns + 1.0 / STEPS_A_TURN);
    for _ in 0..40 {
        let third = (to - from) / 3.0;
        if left(from + third) < left(to - third) {
            to -= third;
        } else {
            from += third;
        }
    }
    0.5 * (from + to)
}

/// A least-squares fit.
struct Fit {
    /// Levels and harmonics.
    coefficients: DVector<f64>,
    /// The diagonal of the inverse of the normal matrix.
    spread: DVector<f64>,
    /// Sum of the squares that are left.
    left: f64,
}

/// Levels and harmonics of a period, m; levels alone of an infinite one.
fn fit(bins: &[Bin], period_m: f64) -> Option<Fit> {
    let count = if period_m.is_finite() { COEFFICIENTS } else { LEVELS };
    let design = DMatrix::from_fn(bins.len(), count, |row, column| {
        let bin = &bins[row];
        let Some(harmonic) = column.checked_sub(LEVELS) else {
            return if bin.direction == column { 1.0 } else { 0.0 };
        };
        let (sine, cosine) = (TAU * (harmonic / 2 + 1) as f64 * bin.position_m / period_m).sin_cos();
        [cosine, sine][harmonic % 2]
    });
    let forces = DVector::from_iterator(bins.len(), bins.iter().map(|bin| bin.force_n));
    let lu = design.tr_mul(&design).lu();
    if lu.u().diagonal().amin() < MIN_PIVOT {
        return None;
    }
    let inverse = lu.try_inverse()?;
    let coefficients = &inverse * design.tr_mul(&forces);
    Some(Fit {
        left: (forces - design * &coefficients).norm_squared(),
        spread: inverse.diagonal(),
        coefficients,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sweep over 40 mm to and fro, with friction of 0.9 and 0.7 N, noise, and some cogging.
    fn sweep(cogging: impl Fn(f64) -> f64) -> Vec<SweepSample> {
        let mut seed = 1_u64;
        let mut noise = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.1
        };
        (0..8000)
            .map(|k| {
                let direction = if k < 4000 { 1.0 } else { -1.0 };
                let travel = f64::from(k % 4000) * 1e-5 - 0.02;
                let position = direction * travel;
                let friction = if direction > 0.0 { 0.9 } else { -0.7 };
                SweepSample {
                    position_m: position,
                    direction,
                    force_n: friction + cogging(position) + noise(),
                    acceleration_mps2: 0.0,
                }
            })
            .collect()
    }

    #[test]
    fn period_and_harmonics_are_found_in_friction_and_noise() {
        let truth = |x: f64| 0.3 * (TAU * x / 0.0073).sin() + 0.1 * (2.0 * TAU * x / 0.0073).cos();
        let found = cogging(&sweep(truth), 1.0).expect("it is there");
        assert!((found.cogging.period_m / 0.0073 - 1.0).abs() < 2e-3, "{found:?}");
        assert!((found.cogging.harmonics[0].sine - 0.3).abs() < 0.005, "{found:?}");
        assert!((found.cogging.harmonics[1].cosine - 0.1).abs() < 0.005, "{found:?}");
        let [least, most] = found.amplitude_interval_n;
        assert!(least < 0.3 && 0.3 < most && most - least < 0.02, "{found:?}");
    }

    #[test]
    fn what_the_mass_takes_is_no_cogging() {
        let mut samples = sweep(|_| 0.0);
        for sample in &mut samples {
            sample.acceleration_mps2 = (TAU * sample.position_m / 0.0073).sin();
            sample.force_n += 0.5 * sample.acceleration_mps2;
        }
        assert!(cogging(&samples, 0.5).is_err());
        let taken = cogging(&samples, 0.0).expect("without the mass it looks like it");
        assert!((taken.amplitude_n - 0.5).abs() < 0.01, "{taken:?}");
    }

    #[test]
    fn sweep_acceleration_comes_from_positions_at_speed() {
        let ticks: Vec<(f64, f64, f64)> = (0..1000)
            .map(|k| {
                let t = f64::from(k) * 1e-3;
                (0.5 * t * t, if k < 500 { 0.01 } else { 0.005 }, 1.0)
            })
            .collect();
        let samples = at_speed(&ticks, 1e-3);
        assert_eq!(samples.len(), 470);
        assert!(
            samples
                .iter()
                .all(|sample| (sample.acceleration_mps2 - 1.0).abs() < 1e-9)
        );
    }

    #[test]
    fn a_rig_without_cogging_has_none_and_says_what_was_seen() {
        let why = cogging(&sweep(|_| 0.0), 1.0).expect_err("there is none");
        assert!(why.contains("no force repeats itself"), "{why}");
        let why = cogging(&sweep(|x| 10.0 * x), 1.0).expect_err("a slope is none");
        println!("{why}");
        assert!(cogging(&[], 1.0).is_err());
    }
}
