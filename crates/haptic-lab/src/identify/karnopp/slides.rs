//! The fit to the slides, with what the calibration and the times of steps add to its errors.

use super::problem::Problem;
use super::regression::{Fit, Rows, Shape, Unknown};
use crate::robust_fit::{NORMAL_95, Unfit};
use nalgebra::DVector;

/// No calibration is better than this share of a value, however narrow the fit's own interval.
pub(in crate::identify) const CALIBRATION_SHARE: f64 = 1e-3;

/// The same for a mass. A grip of stiffness `K` bends the force between two samples, so that its mean differs from the
/// samples by `K T^2 / 12` times the acceleration: 1.7 g at 20 kN/m and 1 kHz.
pub(in crate::identify) const SAMPLING_SHARE: f64 = 3e-3;

/// A fit under its window.
#[derive(Debug)]
pub(super) struct Slides {
    pub(super) rows: Rows,
    pub(super) fit: Fit,
    /// What is not known of the times of the force's steps, in each unknown.
    steps: Option<DVector<f64>>,
    /// By how much another fit differs, in each unknown.
    other: Option<DVector<f64>>,
}

impl Slides {
    pub(super) fn new(problem: &Problem<'_>, rows: Rows, shape: Shape) -> Result<Self, Unfit> {
        let fit = problem.fit(&rows, shape)?;
        Ok(Self::of(problem, rows, fit))
    }

    pub(super) fn of(problem: &Problem<'_>, rows: Rows, fit: Fit) -> Self {
        Self {
            steps: problem.change_with_steps(&rows, fit.shape),
            other: None,
            rows,
            fit,
        }
    }

    /// Mass, viscous and dynamic friction, as far as they are in the fit.
    pub(super) fn unknowns(&self) -> impl Iterator<Item = Unknown> {
        let levels = if self.fit.shape.is_separate { 2 } else { 1 };
        let (mass, viscous) = ([Unknown::Mass], [0, 1].map(Unknown::Viscous));
        let all = mass.into_iter().chain(viscous).chain((0..levels).map(Unknown::Level));
        let there = self.fit.shape.unknowns();
        all.filter(move |unknown| there.contains(unknown))
    }

    /// Adds to the half of intervals.
    pub(super) fn widen(&mut self, by: Vec<(Unknown, f64)>) {
        let mut other = DVector::zeros(self.fit.found.values.len());
        for (unknown, by) in by {
            if let Some(place) = self.fit.place(unknown) {
                other[place] = by;
            }
        }
        self.other = Some(other);
    }

    /// A sum of unknowns with factors, and half of its 95 % interval.
    pub(super) fn value(&self, sum: &[(Unknown, f64)]) -> Option<(f64, f64)> {
        let of = |fit: &Fit| {
            sum.iter()
                .map(|(unknown, factor)| fit.value(*unknown).map(|value| factor * value))
                .sum::<Option<f64>>()
        };
        let value = of(&self.fit)?;
        let statistical = self.fit.uncertainty(sum)?.reach_95();
        let factors = self.fit.factors(sum)?;
        let steps = self.steps.as_ref().map_or(0.0, |steps| NORMAL_95 * factors.dot(steps));
        let other = self.other.as_ref().map_or(0.0, |other| factors.abs().dot(other));
        let floor = match sum {
            [(Unknown::Mass, _)] => SAMPLING_SHARE,
            _ => CALIBRATION_SHARE,
        };
        Some((
            value,
            statistical.hypot(steps).hypot(floor * value) + other + self.fit.bias(sum),
        ))
    }
}
