//! The shift between the clock of the positions and that of the forces, and their drift.
//!
//! Two recorders have two clocks. The shift that leaves least of the force is found over whole samples first,
//! then within them, as one more unknown of the fit: the force's change with time is its coefficient. How much the shift
//! grows over the record is another one.

use super::regression::{Fit, Rows, Shape, Unknown, fit, student};
use crate::identify::Interval;
use crate::identify::grid::Grid;
use crate::smoothing::{weighted, whole};
use nalgebra::{DMatrix, DVector};

/// Rows that the search over whole samples looks at.
const SEARCHED_ROWS: usize = 2000;

/// A shift is applied beyond so many standard errors, as a normal quantile: once in 10,000 records without one.
const SIGNIFICANT: f64 = 3.9;

/// The worst shift leaves at least so many times the squares that the best one leaves, or the motion says nothing of it:
/// what is left scatters by a twentieth where nothing does.
const LEAST_DIFFERENCE: f64 = 1.25;

/// A time between the clocks, with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    /// How much the force's stamps are later than the position's for the same instant, s.
    pub(super) value_s: f64,
    /// Half of its 95 % interval, s.
    pub(super) reach_95_s: f64,
    /// Whether it is certain not to be zero.
    pub(super) is_significant: bool,
}

impl Shift {
    fn new(value_s: f64, unknown: Unknown, fit: &Fit) -> Option<Self> {
        let error_s = fit.error(unknown)?;
        Some(Self {
            value_s,
            reach_95_s: fit.reach_95() * error_s,
            is_significant: value_s.abs() > student(SIGNIFICANT, fit.freedom) * error_s,
        })
    }

    /// The 95 % interval, s.
    pub(super) fn interval(&self) -> Interval {
        [self.value_s - self.reach_95_s, self.value_s + self.reach_95_s]
    }
}

/// Why there is no shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoShift {
    /// Any shift leaves about the same force.
    AllAlike,
    /// No shift within the longest one fits best.
    OutOfReach,
}

/// The shift under which the fit leaves least, within `longest_s`.
pub(super) fn find(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, longest_s: f64) -> Result<Shift, NoShift> {
    let begin_s = search(grid, rows, shape, known_mass, longest_s)?;
    refine(grid, rows, shape, known_mass, begin_s)
        .map(|(shift, _)| shift)
        .filter(|shift| shift.value_s.abs() <= longest_s)
        .ok_or(NoShift::OutOfReach)
}

/// The shift in the middle of the record, and by how much it grows from the first sample to the last; `None` where they
/// cannot be found.
pub(super) fn growing(
    grid: &Grid,
    rows: &Rows,
    shape: Shape,
    known_mass: f64,
    longest_s: f64,
) -> Option<(Shift, Shift)> {
    let begin_s = search(grid, rows, shape, known_mass, longest_s).ok()?;
    let shape = Shape {
        has_growing_shift: true,
        ..shape
    };
    let (shift, growth) = refine(grid, rows, shape, known_mass, begin_s)?;
    Some((shift, growth?))
}

/// The shift in the middle of the record, and its growth where the fit has that, from a shift near it.
fn refine(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, begin_s: f64) -> Option<(Shift, Option<Shift>)> {
    let shape = Shape {
        has_shift: true,
        ..shape
    };
    let (mut value_s, mut growth_s) = (begin_s, 0.0);
    let mut last = None;
    for _ in 0..8 {
        let force = grid.force_shifted(value_s, growth_s);
        let rates = rows.force_rates(&force);
        let forces = without_inertia(rows, rows.forces(&force), known_mass);
        let fit = fit(rows, &forces, &rates, shape).ok()?;
        let (more, grown) = (
            fit.value(Unknown::Shift)?,
            fit.value(Unknown::ShiftGrowth).unwrap_or(0.0),
        );
        value_s += more;
        growth_s += grown;
        let is_small = |change: f64, unknown| fit.error(unknown).is_none_or(|error| change.abs() < 0.01 * error);
        let is_done = is_small(more, Unknown::Shift) && is_small(grown, Unknown::ShiftGrowth);
        last = Some(fit);
        if is_done {
            break;
        }
    }
    let fit = last?;
    Some((
        Shift::new(value_s, Unknown::Shift, &fit)?,
        Shift::new(growth_s, Unknown::ShiftGrowth, &fit),
    ))
}

/// Forces less the known mass's inertia.
pub(super) fn without_inertia(rows: &Rows, mut forces: Vec<f64>, known_mass: f64) -> Vec<f64> {
    for (force, row) in forces.iter_mut().zip(&rows.rows) {
        *force -= known_mass * row.acceleration;
    }
    forces
}

/// The best shift by whole samples, s.
fn search(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, longest_s: f64) -> Result<f64, NoShift> {
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
    let inverse = design.tr_mul(&design).try_inverse().ok_or(NoShift::OutOfReach)?;
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
    let longest = isize::try_from(longest).unwrap_or(isize::MAX);
    let mut best = (0, f64::INFINITY);
    let mut most = 0.0_f64;
    for shift in (-longest..=longest).step_by(step) {
        let left = left_at(shift);
        most = most.max(left);
        if left < best.1 {
            best = (shift, left);
        }
    }
    if most < LEAST_DIFFERENCE * best.1 {
        return Err(NoShift::AllAlike);
    }
    Ok(best.0 as f64 * grid.period_s)
}
