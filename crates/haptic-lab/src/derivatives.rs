//! Velocity and friction of recorded samples at even times.

use crate::smoothing::{Window, slope, weighted};

/// Half the time over which samples are averaged, s: with an encoder of 10 um the velocity is good to
/// 0.1 mm/s, the acceleration to 20 mm/s^2, and 3 Hz come through.
const HALF_WINDOW_S: f64 = 0.02;

/// Velocity of positions, m/s.
pub(crate) fn velocity(position_m: &[f64], period_s: f64) -> Vec<f64> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count of samples"
    )]
    let reach = (HALF_WINDOW_S / period_s).round() as usize;
    slope(position_m, reach, period_s)
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
