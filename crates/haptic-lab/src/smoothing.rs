//! Derivatives of noisy samples: windows, and the noise that they are chosen by.
//!
//! Friction is fitted in the weak form. Newton's law is multiplied by a window `h` that is smooth and zero
//! at its ends, and integrated; by parts, both derivatives of the position fall on the window:
//!
//! ```text
//! M (h'' * x) + h * friction + offset = h * F
//! ```
//!
//! Every term passes the same filter, friction's changes of direction included. So the mass does not
//! depend on the window, where a Savitzky-Golay filter's second derivative and its smoothed force have
//! different bandwidths.

/// Exponent of the window `(1 - u^2)^n`: its fourth derivative is still continuous, so that few samples
/// already integrate it well.
const EXPONENT: i32 = 5;

/// A window and its derivatives, for samples from `-reach` to `reach` around a place.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    /// Samples on either side.
    pub(crate) reach: usize,
    /// Weights whose sum is 1.
    pub(crate) mean: Vec<f64>,
    /// Weights that give the first derivative, 1/s.
    pub(crate) slope: Vec<f64>,
    /// Weights that give the second derivative, 1/s^2.
    pub(crate) curvature: Vec<f64>,
}

impl Window {
    /// A window of `half_s` on either side, of at least `MIN_REACH` samples.
    pub(crate) fn new(half_s: f64, period_s: f64) -> Self {
        let half = half_s / period_s;
        let reach = whole(half.ceil());
        let places: Vec<f64> = (0..=2 * reach).map(|index| index as f64 - reach as f64).collect();
        let bump = |u: f64, power: i32| (1.0 - u * u).max(0.0).powi(power);
        let mut mean: Vec<f64> = places.iter().map(|k| bump(k / half, EXPONENT)).collect();
        let sum: f64 = mean.iter().sum();
        mean.iter_mut().for_each(|weight| *weight /= sum);
        let n = f64::from(EXPONENT);
        let mut slope: Vec<f64> = places
            .iter()
            .map(|k| 2.0 * n * k / half * bump(k / half, EXPONENT - 1))
            .collect();
        let moment: f64 = slope.iter().zip(&places).map(|(w, k)| w * k).sum();
        let scale = 1.0 / (moment * period_s);
        slope.iter_mut().for_each(|weight| *weight *= scale);
        let mut curvature: Vec<f64> = places
            .iter()
            .map(|k| {
                let u = k / half;
                4.0 * n * (n - 1.0) * u * u * bump(u, EXPONENT - 2) - 2.0 * n * bump(u, EXPONENT - 1)
            })
            .collect();
        // Exact for constants and for parabolas, whatever the number of samples.
        let rest = curvature.iter().sum::<f64>();
        for (weight, share) in curvature.iter_mut().zip(&mean) {
            *weight -= rest * share;
        }
        let moment: f64 = curvature.iter().zip(&places).map(|(w, k)| w * k * k).sum();
        let scale = 2.0 / (moment * period_s * period_s);
        curvature.iter_mut().for_each(|weight| *weight *= scale);
        Self {
            reach,
            mean,
            slope,
            curvature,
        }
    }

    /// Standard deviation of the second derivative for samples with white noise of 1.
    pub(crate) fn curvature_noise(&self) -> f64 {
        self.curvature.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
    }
}

/// The whole part of a number of samples; 0 where it is negative.
#[expect(clippy::cast_sign_loss, reason = "a negative number becomes 0")]
pub(crate) fn whole(samples: f64) -> usize {
    samples as usize
}

/// The weighted sum of `values` around `at`, from `base`, so that large values keep their digits. Four sums side by
/// side are what a processor adds at once.
pub(crate) fn weighted(weights: &[f64], values: &[f64], at: usize, base: f64) -> f64 {
    let reach = weights.len() / 2;
    let about = &values[at - reach..=at + reach];
    let ((weights, last_weights), (about, last)) = (weights.as_chunks::<4>(), about.as_chunks::<4>());
    let [mut a, mut b, mut c, mut d] = [0.0; 4];
    for ([p, q, r, s], [w, x, y, z]) in weights.iter().zip(about) {
        a += p * (w - base);
        b += q * (x - base);
        c += r * (y - base);
        d += s * (z - base);
    }
    for (weight, value) in last_weights.iter().zip(last) {
        a += weight * (value - base);
    }
    a + b + c + d
}

/// The slope of the straight line through `2 reach + 1` samples around each one, per second: the first
/// derivative of Savitzky and Golay's filter of first and second order. At the ends it is that of the
/// first and last full window.
pub(crate) fn slope(values: &[f64], reach: usize, period_s: f64) -> Vec<f64> {
    let n = values.len();
    let reach = reach.min((n - 1) / 2).max(1);
    let square: f64 = (1..=reach).map(|k| 2.0 * (k * k) as f64).sum();
    let at = |index: usize| {
        (1..=reach)
            .map(|k| k as f64 * (values[index + k] - values[index - k]))
            .sum::<f64>()
            / (square * period_s)
    };
    let mut slopes = vec![0.0; n];
    for (index, slope) in slopes.iter_mut().enumerate() {
        *slope = at(index.clamp(reach, n - 1 - reach));
    }
    slopes
}

/// Standard deviation of [`slope`] for samples with white noise of 1, per second.
pub(crate) fn slope_noise(reach: usize, period_s: f64) -> f64 {
    let square: f64 = (1..=reach).map(|k| 2.0 * (k * k) as f64).sum();
    1.0 / (square.sqrt() * period_s)
}

/// Standard deviation of the white noise in samples of a smooth curve: their fourth differences, without
/// the tenth that is largest, which breakaways and glitches fill.
pub(crate) fn white_noise(values: &[f64], is_used: &[bool]) -> f64 {
    /// Standard deviation of a normal variable without the tenth that is farthest from 0.
    const TRIMMED: f64 = 0.7892;
    /// Norm of 1, -4, 6, -4, 1.
    const GAIN: f64 = 8.366_600_265_340_756;
    let mut squares: Vec<f64> = values
        .windows(5)
        .zip(is_used)
        .filter(|(_, used)| **used)
        .map(|(v, _)| (v[0] - 4.0 * v[1] + 6.0 * v[2] - 4.0 * v[3] + v[4]).powi(2))
        .collect();
    squares.sort_unstable_by(f64::total_cmp);
    squares.truncate(squares.len() * 9 / 10);
    if squares.is_empty() {
        return 0.0;
    }
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / (TRIMMED * GAIN)
}

/// The step of an encoder: the smallest change between samples, where every change is a multiple of it;
/// `None` for positions without steps.
pub(crate) fn encoder_step(values: &[f64]) -> Option<f64> {
    /// Largest share of a step by which written positions may miss a multiple.
    const ROUNDING: f64 = 0.02;
    /// Changes looked at.
    const ENOUGH: usize = 20_000;
    let changes: Vec<f64> = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|change| *change > 0.0)
        .take(ENOUGH)
        .collect();
    let least = changes.iter().copied().fold(f64::INFINITY, f64::min);
    if changes.len() < 20 || changes.iter().all(|change| *change < 1.5 * least) && changes.len() < 100 {
        return None;
    }
    // The smallest of few changes bears the rounding of one number; the mean of the single steps less.
    let singles: Vec<f64> = changes.iter().copied().filter(|change| *change < 1.5 * least).collect();
    let step = singles.iter().sum::<f64>() / singles.len() as f64;
    changes
        .iter()
        .all(|change| {
            let count = (change / step).round();
            (change / step - count).abs() <= ROUNDING * count.max(1.0).sqrt()
        })
        .then_some(step)
}

/// Half the time over which samples are averaged, s: with an encoder of 10 um the velocity is good to
/// 0.1 mm/s, the acceleration to 20 mm/s^2, and 3 Hz come through.
pub(crate) const HALF_WINDOW_S: f64 = 0.02;

/// Velocity of positions, m/s.
pub(crate) fn velocity(position_m: &[f64], period_s: f64) -> Vec<f64> {
    slope(position_m, whole((HALF_WINDOW_S / period_s).round()), period_s)
}

/// Force less `mass a`, N. Both pass the same filter: else the inertia of a stop, which takes less time
/// than the acceleration is averaged over, would be left in the friction.
pub(crate) fn less_inertia(force_n: &[f64], position_m: &[f64], mass_kg: f64, period_s: f64) -> Vec<f64> {
    let window = Window::new(HALF_WINDOW_S.max(2.0 * period_s), period_s);
    let count = force_n.len();
    if count < 2 * window.reach + 1 {
        return force_n.to_vec();
    }
    (0..count)
        .map(|index| {
            let at = index.clamp(window.reach, count - 1 - window.reach);
            let acceleration = weighted(&window.curvature, position_m, at, position_m[at]);
            weighted(&window.mean, force_n, at, 0.0) - mass_kg * acceleration
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_gives_exact_derivatives_and_mean() {
        for half in [4.0, 6.5, 20.0, 100.0] {
            let window = Window::new(half * 1e-3, 1e-3);
            let x: Vec<f64> = (0..400)
                .map(|k| 7.0 + 2.0 * (f64::from(k) * 1e-3 - 0.1).powi(2))
                .collect();
            let curvature = weighted(&window.curvature, &x, 200, x[200]);
            assert!((curvature - 4.0).abs() < 1e-8, "{half}: {curvature}");
            assert!((weighted(&window.mean, &[3.0; 400], 200, 0.0) - 3.0).abs() < 1e-12);
            let slope = weighted(&window.slope, &x, 200, x[200]);
            assert!((slope - 0.4).abs() < 1e-9, "{half}: {slope}");
        }
    }

    #[test]
    fn both_derivatives_pass_the_same_filter() {
        // On a sine the mean and the curvature differ by the square of the frequency alone.
        let window = Window::new(40e-3, 1e-3);
        let omega = 2.0 * std::f64::consts::PI * 9.0;
        let x: Vec<f64> = (0..400).map(|k| (omega * f64::from(k) * 1e-3).sin()).collect();
        let (mean, curvature) = (
            weighted(&window.mean, &x, 210, 0.0),
            weighted(&window.curvature, &x, 210, x[210]),
        );
        assert!((curvature / (-omega * omega * mean) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn slopes_are_those_of_the_line() {
        let x: Vec<f64> = (0..50).map(|k| 3.0 + 0.25 * f64::from(k)).collect();
        for slope in slope(&x, 4, 0.5) {
            assert!((slope - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn noise_and_the_encoders_step_are_found_in_the_samples() {
        let mut state = 1_u64;
        let mut noise = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                sum += (state >> 33) as f64 / (1_u64 << 31) as f64;
            }
            sum - 6.0
        };
        let smooth: Vec<f64> = (0..5000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        let noisy: Vec<f64> = smooth.iter().map(|x| x + 2e-3 * noise()).collect();
        let found = white_noise(&noisy, &[true; 5000]);
        assert!((found / 2e-3 - 1.0).abs() < 0.05, "{found}");
        assert_eq!(encoder_step(&noisy), None);
        let stepped: Vec<f64> = smooth.iter().map(|x| (x / 1e-3).round() * 1e-3).collect();
        let step = encoder_step(&stepped).expect("an encoder");
        assert!((step / 1e-3 - 1.0).abs() < 1e-3, "{step}");
    }

    #[test]
    fn a_parabola_has_its_velocity_and_no_friction() {
        let time = |k: u32| f64::from(k) * 1e-3;
        let position: Vec<f64> = (0..200).map(|k| 0.1 * time(k) + 1.5 * time(k).powi(2)).collect();
        let velocity = velocity(&position, 1e-3);
        let friction = less_inertia(&[8.0; 200], &position, 2.0, 1e-3);
        for k in 20..180 {
            let expected = 0.1 + 3.0 * time(k);
            let k = k as usize;
            assert!((velocity[k] - expected).abs() < 1e-9, "{k}: {}", velocity[k]);
            assert!((friction[k] - 2.0).abs() < 1e-6, "{k}: {}", friction[k]);
        }
    }

    #[test]
    fn a_blow_leaves_no_inertia_in_the_friction() {
        // 1 kg at 0.2 m/s, stopped within 2 ms by 100 N, against 3 N of friction before.
        let mut position = vec![0.0; 400];
        let mut force = vec![3.0; 400];
        let mut velocity: f64 = 0.2;
        for k in 1..400 {
            let acceleration = if (200..202).contains(&k) { -100.0 } else { 0.0 };
            force[k - 1] = 3.0 + acceleration;
            position[k] = position[k - 1] + velocity * 1e-3 + 0.5 * acceleration * 1e-6;
            velocity += acceleration * 1e-3;
        }
        let worst = |friction: &[f64]| friction.iter().map(|f| (f - 3.0).abs()).fold(0.0, f64::max);
        let found = worst(&less_inertia(&force, &position, 1.0, 1e-3));
        assert!(found < 1.0, "{found}");
    }
}
