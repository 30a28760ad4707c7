//! An encoder's steps made smooth: about each sample the cubic over the longest window in which it stays within half a
//! step of what was counted (Janabi-Sharifi, Hayward and Chen 2000 do so with straight lines).
//!
//! Slow motion, in which the steps are far apart, so gets a long window, and a turn a short one.

use super::super::sensor::samples_in;
use crate::smoothing::weighted;
use std::sync::Arc;

/// Halves of the windows, s.
const HALF_WINDOWS_S: [f64; 9] = [0.003, 0.004, 0.006, 0.009, 0.013, 0.019, 0.028, 0.04, 0.06];
/// How far a count may be from the cubic, in steps: half of one, and a little for what the cubic does not know.
const WITHIN_STEPS: f64 = 0.56;

/// Samples after which the window is chosen again.
const CHOSEN_EVERY: usize = 3;

/// Weights that give the cubic through the samples of a window (Savitzky and Golay 1964).
#[derive(Debug)]
struct Window {
    half: usize,
    /// At each place, what the cubic polynomials that are orthogonal over the window weigh there.
    weights: Vec<[f64; 4]>,
    /// The values of those polynomials there.
    values: Vec<[f64; 4]>,
    /// Weights of the value in the middle, and of the slope there.
    middle: (Vec<f64>, Vec<f64>),
}

impl Window {
    fn new(half: usize) -> Self {
        let places: Vec<f64> = (0..=2 * half).map(|k| k as f64 - half as f64).collect();
        let moment = |power: i32| places.iter().map(|i| i.powi(power)).sum::<f64>();
        let (squares, fourths) = (moment(2) / moment(0), moment(4) / moment(2));
        let polynomials = |&i: &f64| [1.0, i, i * i - squares, i * (i * i - fourths)];
        let values: Vec<[f64; 4]> = places.iter().map(polynomials).collect();
        let norms: [f64; 4] = std::array::from_fn(|order| values.iter().map(|value| value[order].powi(2)).sum());
        let weights: Vec<[f64; 4]> = values
            .iter()
            .map(|value| std::array::from_fn(|order| value[order] / norms[order]))
            .collect();
        let sum = |one: usize, other: usize, factor: f64| {
            let weights = weights.iter();
            weights.map(|weight| weight[one] + factor * weight[other]).collect()
        };
        Self {
            half,
            middle: (sum(0, 2, -squares), sum(1, 3, -fourths)),
            weights,
            values,
        }
    }

    /// Whether the cubic about a sample is near all that was counted.
    fn is_near(&self, counted: &[f64], at: usize, within: f64) -> bool {
        let about = &counted[at - self.half..=at + self.half];
        let base = counted[at];
        let [mut a, mut b, mut c, mut d] = [0.0; 4];
        for ([p, q, r, s], count) in self.weights.iter().zip(about) {
            let count = count - base;
            a += p * count;
            b += q * count;
            c += r * count;
            d += s * count;
        }
        about
            .iter()
            .zip(&self.values)
            .all(|(count, [_, linear, square, cube])| {
                let here = a + b * linear + c * square + d * cube;
                (count - base - here).abs() <= within
            })
    }
}

/// The windows of a record, and which of them each sample gets; `None` at the ends, where there is no room.
#[derive(Clone, Debug)]
pub(crate) struct Windows {
    all: Arc<[Window]>,
    /// How far a count may be from the cubic, m.
    within: f64,
    chosen: Vec<Option<u8>>,
}

impl Windows {
    /// The windows for counted positions, m. `noise` is the root mean square of what shakes the counts beside the
    /// steps, m.
    pub(crate) fn new(counted: &[f64], period_s: f64, step: f64, noise: f64) -> Self {
        let within = WITHIN_STEPS * step + 3.5 * noise;
        let mut all: Vec<Window> = Vec::new();
        for half_s in HALF_WINDOWS_S {
            let half = samples_in(half_s, period_s).max(3);
            if all.last().is_none_or(|window| window.half < half) {
                all.push(Window::new(half));
            }
        }
        let windows = Self {
            all: all.into(),
            within,
            chosen: Vec::new(),
        };
        windows.chosen_again(counted)
    }

    /// The same windows, chosen for other counts, m.
    pub(crate) fn chosen_again(&self, counted: &[f64]) -> Self {
        let (all, last) = (&self.all, counted.len() - 1);
        // Neighbours have about the same window.
        let mut longest = 0_u8;
        let choice = |at: usize| {
            let room = at.min(last - at);
            if all[0].half > room {
                return None;
            }
            let fits = |window: &Window| window.half <= room && window.is_near(counted, at, self.within);
            if at.is_multiple_of(CHOSEN_EVERY) {
                while longest > 0 && !fits(&all[usize::from(longest)]) {
                    longest -= 1;
                }
                while all.get(usize::from(longest) + 1).is_some_and(fits) {
                    longest += 1;
                }
            }
            while all[usize::from(longest)].half > room {
                longest -= 1;
            }
            // The next shorter one is nearly as free of steps, and bends the motion a fifth as much.
            Some(longest.saturating_sub(1))
        };
        Self {
            all: self.all.clone(),
            within: self.within,
            chosen: (0..counted.len()).map(choice).collect(),
        }
    }

    /// Positions without the steps, and velocities per sample, of the motion for which the windows were chosen.
    pub(crate) fn smooth(&self, counted: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let last = counted.len() - 1;
        let smooth = |(at, chosen): (usize, &Option<u8>)| {
            let Some(chosen) = chosen else {
                let (before, after) = (at.saturating_sub(1), (at + 1).min(last));
                return (
                    counted[at],
                    (counted[after] - counted[before]) / (after - before) as f64,
                );
            };
            let (value, slope) = &self.all[usize::from(*chosen)].middle;
            (
                counted[at] + weighted(value, counted, at, counted[at]),
                weighted(slope, counted, at, counted[at]),
            )
        };
        self.chosen.iter().enumerate().map(smooth).unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square of the error of a motion counted in steps of 10 um at 1 kHz, m.
    fn error(motion: impl Fn(f64) -> f64) -> f64 {
        let truth: Vec<f64> = (0..4000).map(|k| motion(f64::from(k) * 1e-3)).collect();
        let counted: Vec<f64> = truth.iter().map(|x| (x / 1e-5).round() * 1e-5).collect();
        let (smooth, _) = Windows::new(&counted, 1e-3, 1e-5, 0.0).smooth(&counted);
        let inner = 200..3800;
        let squares: f64 = inner.clone().map(|k| (smooth[k] - truth[k]).powi(2)).sum();
        (squares / inner.len() as f64).sqrt()
    }

    #[test]
    fn slow_motion_and_turns_lose_most_of_the_steps() {
        // The steps alone are 2.9 um.
        let errors = [
            error(|t| 1.03e-3 * t),
            error(|t| 0.015 * (t * 12.0).sin()),
            error(|t| 0.5e-3 * (t * 10.0).sin()),
        ];
        assert!(
            errors[0] < 0.7e-6 && errors[1] < 1.2e-6 && errors[2] < 1.0e-6,
            "{errors:?}"
        );
    }

    #[test]
    fn a_cubic_is_smoothed_to_itself() {
        let values: Vec<f64> = (0..1000)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| 3.0 + t - t * t * t)
            .collect();
        let (smooth, speed) = Windows::new(&values, 1e-3, 0.0, 1e-12).smooth(&values);
        for k in 10..990 {
            let t = k as f64 * 1e-3;
            assert!((smooth[k] - values[k]).abs() < 1e-11);
            assert!((speed[k] / 1e-3 - (1.0 - 3.0 * t * t)).abs() < 1e-7);
        }
    }
}
