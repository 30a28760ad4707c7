//! The fit to the slides, with what the windows around its own and the calibration add to its errors.

use super::problem::Problem;
use super::regression::{Fit, Rows, Shape, Unknown};
use crate::robust_fit::{NORMAL_95, Unfit};
use nalgebra::DVector;

/// No calibration is better than this share of a value, however narrow the fit's own interval.
pub(in crate::identify) const CALIBRATION_SHARE: f64 = 1e-3;

/// The same for a mass. A grip of stiffness `K` bends the force between two samples, so that its mean differs from the
/// samples by `K T^2 / 12` times the acceleration: 1.7 g at 20 kN/m and 1 kHz.
pub(in crate::identify) const SAMPLING_SHARE: f64 = 3e-3;

/// A fit under its window, and the fits under a shorter and a longer one.
#[derive(Debug)]
pub(super) struct Slides {
    pub(super) rows: Rows,
    pub(super) fit: Fit,
    pub(super) neighbours: Vec<Fit>,
    /// Standard deviation of the acceleration's noise, m/s^2.
    pub(super) acceleration_noise: f64,
    /// What is not known of the times of the force's steps, in each unknown.
    steps: Option<DVector<f64>>,
}

impl Slides {
    pub(super) fn new(problem: &Problem<'_>, rows: Rows, shape: Shape) -> Result<Self, Unfit> {
        let neighbours = [1.0 / 1.5, 1.5]
            .into_iter()
            .filter_map(|factor| {
                let rows = Rows::new(problem.grid, problem.motion, factor * rows.half_s);
                problem.fit(&rows, shape).ok()
            })
            .collect();
        Ok(Self {
            fit: problem.fit(&rows, shape)?,
            neighbours,
            acceleration_noise: problem.motion.acceleration_noise(&rows.window),
            steps: problem.change_with_steps(&rows, shape),
            rows,
        })
    }

    /// A sum of unknowns with factors, and half of its 95 % interval.
    pub(super) fn value(&self, sum: &[(Unknown, f64)]) -> Option<(f64, f64)> {
        let of = |fit: &Fit| {
            sum.iter()
                .map(|(unknown, factor)| fit.value(*unknown).map(|value| factor * value))
                .sum::<Option<f64>>()
        };
        let value = of(&self.fit)?;
        let all = || self.neighbours.iter().filter_map(of).chain([value]);
        let spread = all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min);
        let statistical = self.fit.reach_95() * self.fit.combined_error(sum)?;
        let steps: f64 = self.steps.as_ref().map_or(0.0, |steps| {
            let of = |(unknown, factor): &(Unknown, f64)| {
                self.fit.place(*unknown).map_or(0.0, |place| factor * steps[place])
            };
            NORMAL_95 * sum.iter().map(of).sum::<f64>()
        });
        let bias = match sum {
            [(Unknown::Mass, _)] => value * self.fit.attenuation(Unknown::Mass, self.acceleration_noise)?,
            _ => 0.0,
        };
        let floor = match sum {
            [(Unknown::Mass, _)] => SAMPLING_SHARE,
            _ => CALIBRATION_SHARE,
        };
        Some((
            value,
            statistical.hypot(spread / 2.0).hypot(steps) + bias.abs() + floor * value.abs(),
        ))
    }
}
