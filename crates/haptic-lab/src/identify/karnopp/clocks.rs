//! The shift between the clock of the positions and that of the forces.
//!
//! Two recorders have two clocks. The shift that leaves least of the force is found over whole samples first,
//! then within them, as one more unknown of the fit: the force's change with time is its coefficient.

use super::regression::{Rows, Shape, Unknown, fit, student};
use crate::identify::grid::Grid;
use crate::smoothing::{weighted, whole};
use nalgebra::{DMatrix, DVector};

/// Rows that the search over whole samples looks at.
const SEARCHED_ROWS: usize = 2000;

/// A shift is applied beyond so many standard errors, as a normal quantile: once in 10,000 records without one.
const SIGNIFICANT: f64 = 3.9;

/// A shift of the clocks, with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    /// How much the force's stamps are later than the position's for the same instant, s.
    pub(super) value_s: f64,
    /// Half of its 95 % interval, s.
    pub(super) reach_95_s: f64,
    /// Whether it is certain not to be zero.
    pub(super) is_significant: bool,
}

/// The shift under which the fit leaves least; `None` where a fit or a shift within `longest_s` cannot be found.
pub(super) fn find(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, longest_s: f64) -> Option<Shift> {
    let shape = Shape {
        has_shift: true,
        ..shape
    };
    let mut value_s = search(grid, rows, shape, known_mass, longest_s)?;
    let mut found = None;
    for _ in 0..5 {
        let force = grid.force_shifted(value_s);
        let rates = rows.force_rates(&force);
        let forces = without_inertia(rows, rows.forces(&force), known_mass);
        let fit = fit(rows, &forces, &rates, shape).ok()?;
        let more = fit.value(Unknown::Shift)?;
        value_s += more;
        let error = fit.error(Unknown::Shift)?;
        found = Some((error, fit.reach_95(), fit.freedom));
        if more.abs() < 0.01 * error {
            break;
        }
    }
    let (error, reach, freedom) = found?;
    (value_s.abs() <= longest_s).then_some(Shift {
        value_s,
        reach_95_s: reach * error,
        is_significant: value_s.abs() > student(SIGNIFICANT, freedom) * error,
    })
}

/// Forces less the known mass's inertia.
pub(super) fn without_inertia(rows: &Rows, mut forces: Vec<f64>, known_mass: f64) -> Vec<f64> {
    for (force, row) in forces.iter_mut().zip(&rows.rows) {
        *force -= known_mass * row.acceleration;
    }
    forces
}

/// The best shift by whole samples, s.
fn search(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, longest_s: f64) -> Option<f64> {
    let longest = whole((longest_s / grid.period_s).ceil());
    let step = (rows.window.reach / 8).max(1);
    let reach = longest + rows.window.reach;
    let thinned: Vec<_> = rows
        .rows
        .iter()
        .step_by(rows.rows.len().div_ceil(SEARCHED_ROWS).max(1))
        .filter(|row| row.at >= reach && row.at + reach < grid.len())
        .copied()
        .collect();
    let unknowns = Shape {
        has_shift: false,
        ..shape
    }
    .unknowns();
    let design = DMatrix::from_fn(thinned.len(), unknowns.len(), |i, j| {
        shape.coefficient(unknowns[j], &thinned[i], 0.0)
    });
    let inverse = design.tr_mul(&design).try_inverse()?;
    let left_at = |shift: isize| {
        let forces = DVector::from_iterator(
            thinned.len(),
            thinned.iter().map(|row| {
                let at = row.at.saturating_add_signed(shift);
                weighted(&rows.window.mean, &grid.force_n, at, 0.0) - known_mass * row.acceleration
            }),
        );
        let right = design.tr_mul(&forces);
        forces.norm_squared() - right.dot(&(&inverse * &right))
    };
    let longest = isize::try_from(longest).ok()?;
    let best = (-longest..=longest)
        .step_by(step)
        .map(|shift| (shift, left_at(shift)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(best.0 as f64 * grid.period_s)
}
