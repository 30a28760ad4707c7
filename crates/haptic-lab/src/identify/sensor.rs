//! What sensors do to a force and a position: noise, and an encoder's steps.

use fastrand::Rng;
use std::f64::consts::TAU;

/// How many samples a duration has, rounded.
#[expect(clippy::cast_sign_loss, reason = "a duration is not negative")]
pub(super) fn samples_in(duration_s: f64, period_s: f64) -> usize {
    (duration_s / period_s).round() as usize
}

/// A number of the standard normal distribution (Box and Muller 1958).
pub(super) fn normal(random: &mut Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    radius * (TAU * random.f64()).cos()
}

/// Normal noise of a root mean square. Each value keeps the share `memory` of the one before it; 0 is white noise.
pub(super) fn noise(random: &mut Rng, rms: f64, memory: f64, samples: usize) -> Vec<f64> {
    let innovation = rms * (1.0 - memory * memory).sqrt();
    let mut value = rms * normal(random);
    (0..samples)
        .map(|_| {
            let now = value;
            value = memory * value + innovation * normal(random);
            now
        })
        .collect()
}

/// Positions (m) as an encoder counts them, whose steps begin at a chance place. A step of 0 counts exactly.
pub(super) fn counted(random: &mut Rng, positions_m: &[f64], step_m: f64) -> Vec<f64> {
    let start = random.f64() * step_m;
    let count = |position: f64| {
        if step_m > 0.0 {
            ((position - start) / step_m).round() * step_m
        } else {
            position
        }
    };
    positions_m.iter().map(|&position| count(position)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_rms_and_its_memory() {
        let values = noise(&mut Rng::with_seed(1), 0.5, 0.9, 200_000);
        let mean = |product: &dyn Fn(usize) -> f64| (1..values.len()).map(product).sum::<f64>() / values.len() as f64;
        let (square, neighbours) = (mean(&|k| values[k] * values[k]), mean(&|k| values[k] * values[k - 1]));
        assert!((square.sqrt() - 0.5).abs() < 0.01, "{}", square.sqrt());
        assert!((neighbours / square - 0.9).abs() < 0.01, "{}", neighbours / square);
    }
}
