//! Velocity and acceleration of recorded positions.

/// Half the time over which a parabola is laid through the positions, s: with an encoder of 10 um its
/// velocity is good to 0.1 mm/s, its acceleration to 10 mm/s^2, and 3 Hz come through.
const HALF_WINDOW_S: f64 = 0.02;

/// The median time between two samples, s.
pub(crate) fn usual_period_s(t_s: &[f64]) -> f64 {
    let mut periods: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    periods.sort_unstable_by(f64::total_cmp);
    periods.get(periods.len() / 2).copied().unwrap_or(1e-3)
}

/// Velocity and acceleration of the parabola that fits best around each sample (Savitzky and Golay
/// 1964). Near the ends they are those of the first and the last whole window.
pub(crate) fn derivatives(position_m: &[f64], period_s: f64) -> (Vec<f64>, Vec<f64>) {
    let count = position_m.len();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count of samples"
    )]
    let half = ((HALF_WINDOW_S / period_s).round() as usize).clamp(1, (count - 1) / 2);
    let offsets: Vec<f64> = (0..=2 * half).map(|place| place as f64 - half as f64).collect();
    let sum = |power: i32| offsets.iter().map(|offset| offset.powi(power)).sum::<f64>();
    let (second, fourth, window) = (sum(2), sum(4), offsets.len() as f64);
    let mean = second / window;
    let bend = (fourth - second * mean) * period_s * period_s;
    let at = |middle: usize| {
        let part = &position_m[middle - half..=middle + half];
        let (slope, curve) = offsets
            .iter()
            .zip(part)
            .fold((0.0, 0.0), |(slope, curve), (offset, position)| {
                (slope + offset * position, curve + (offset * offset - mean) * position)
            });
        (slope / (second * period_s), 2.0 * curve / bend)
    };
    (0..count).map(|index| at(index.clamp(half, count - 1 - half))).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_velocity_and_acceleration() {
        let position: Vec<f64> = (0..200)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| 0.1 * t + 1.5 * t * t)
            .collect();
        let (velocity, acceleration) = derivatives(&position, 1e-3);
        for k in 20..180 {
            let t = k as f64 * 1e-3;
            assert!((velocity[k] - 0.1 - 3.0 * t).abs() < 1e-9, "{k}: {}", velocity[k]);
            assert!((acceleration[k] - 3.0).abs() < 1e-6, "{k}: {}", acceleration[k]);
        }
    }
}
