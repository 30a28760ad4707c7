//! An encoder's steps made smooth: about each sample the cubic over the longest window in which it stays within half a
//! step of what was counted (Janabi-Sharifi, Hayward and Chen 2000 do so with straight lines).
//!
//! Slow motion, in which the steps are far apart, so gets a long window, and a turn a short one.

/// Halves of the windows, s.
const HALF_WINDOWS_S: [f64; 9] = [0.003, 0.004, 0.006, 0.009, 0.013, 0.019, 0.028, 0.04, 0.06];
/// How far a count may be from the cubic, in steps: half of one, and a little for what the cubic does not know.
const WITHIN_STEPS: f64 = 0.56;

/// The cubic polynomials that are orthogonal over a window.
struct Window {
    half: usize,
    /// Values at each place, and the sum of their squares.
    polynomials: [(Vec<f64>, f64); 4],
    /// Value of the second polynomial in the middle.
    second_in_middle: f64,
    /// Slope of the third polynomial in the middle, per sample.
    third_slope: f64,
}

impl Window {
    fn new(half: usize) -> Self {
        let places: Vec<f64> = (0..=2 * half).map(|k| k as f64 - half as f64).collect();
        let moment = |power: i32| places.iter().map(|i| i.powi(power)).sum::<f64>();
        let (squares, fourths) = (moment(2) / moment(0), moment(4) / moment(2));
        let polynomial = |of: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = places.iter().map(|&i| of(i)).collect();
            let norm = values.iter().map(|value| value * value).sum();
            (values, norm)
        };
        Self {
            half,
            polynomials: [
                polynomial(&|_| 1.0),
                polynomial(&|i| i),
                polynomial(&|i| i * i - squares),
                polynomial(&|i| i * (i * i - fourths)),
            ],
            second_in_middle: -squares,
            third_slope: -fourths,
        }
    }

    /// Coefficients of the cubic through the values about one, less that one.
    fn cubic(&self, values: &[f64], at: usize) -> [f64; 4] {
        let about = &values[at - self.half..=at + self.half];
        let mut sums = [0.0; 4];
        for (sum, (polynomial, norm)) in sums.iter_mut().zip(&self.polynomials) {
            let products = polynomial
                .iter()
                .zip(about)
                .map(|(weight, value)| weight * (value - values[at]));
            *sum = products.sum::<f64>() / norm;
        }
        sums
    }

    /// Whether the cubic about one is near all that was counted.
    fn is_near(&self, values: &[f64], at: usize, within: f64) -> bool {
        let cubic = self.cubic(values, at);
        let [(_, _), (first, _), (second, _), (third, _)] = &self.polynomials;
        let about = &values[at - self.half..=at + self.half];
        about.iter().enumerate().all(|(k, value)| {
            let here = cubic[0] + cubic[1] * first[k] + cubic[2] * second[k] + cubic[3] * third[k];
            (value - values[at] - here).abs() <= within
        })
    }
}

/// Positions without the steps, and velocities per sample. `noise` is the root mean square of what shakes the counts
/// beside the steps.
pub(crate) fn smooth(counted: &[f64], period_s: f64, step: f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
    let within = WITHIN_STEPS * step + 3.5 * noise;
    let mut windows: Vec<Window> = Vec::new();
    for half_s in HALF_WINDOWS_S {
        let half = ((half_s / period_s).round() as usize).max(3);
        if windows.last().is_none_or(|window| window.half < half) {
            windows.push(Window::new(half));
        }
    }
    let last = counted.len() - 1;
    // Neighbours have about the same window.
    let mut chosen = 0;
    (0..counted.len())
        .map(|at| {
            let room = at.min(last - at);
            while chosen > 0 && windows[chosen].half > room {
                chosen -= 1;
            }
            if windows[0].half > room {
                let (before, after) = (at.saturating_sub(1), (at + 1).min(last));
                return (
                    counted[at],
                    (counted[after] - counted[before]) / (after - before) as f64,
                );
            }
            let fits = |window: &Window| window.half <= room && window.is_near(counted, at, within);
            while chosen > 0 && !fits(&windows[chosen]) {
                chosen -= 1;
            }
            while windows.get(chosen + 1).is_some_and(fits) {
                chosen += 1;
            }
            // The next shorter one is nearly as free of steps, and bends the motion a fifth as much.
            let window = &windows[chosen.saturating_sub(1)];
            let cubic = window.cubic(counted, at);
            let value = counted[at] + cubic[0] + cubic[2] * window.second_in_middle;
            (value, cubic[1] + cubic[3] * window.third_slope)
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square of the error of a motion counted in steps of 10 um at 1 kHz, m.
    fn error(motion: impl Fn(f64) -> f64) -> f64 {
        let truth: Vec<f64> = (0..4000).map(|k| motion(f64::from(k) * 1e-3)).collect();
        let counted: Vec<f64> = truth.iter().map(|x| (x / 1e-5).round() * 1e-5).collect();
        let (smooth, _) = smooth(&counted, 1e-3, 1e-5, 0.0);
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
            errors[0] < 0.7e-6 && errors[1] < 1.0e-6 && errors[2] < 1.0e-6,
            "{errors:?}"
        );
    }

    #[test]
    fn a_cubic_is_smoothed_to_itself() {
        let values: Vec<f64> = (0..1000)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| 3.0 + t - t * t * t)
            .collect();
        let (smooth, speed) = smooth(&values, 1e-3, 0.0, 1e-12);
        for k in 10..990 {
            let t = k as f64 * 1e-3;
            assert!((smooth[k] - values[k]).abs() < 1e-11);
            assert!((speed[k] / 1e-3 - (1.0 - 3.0 * t * t)).abs() < 1e-7);
        }
    }
}
