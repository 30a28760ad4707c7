//! The shift between the clock of the positions and that of the forces, and their drift.
//!
//! The shift that leaves least of the force is found over whole samples first, then within them, as one more unknown of
//! the fit: the force's change with time is its coefficient.

use super::regression::{Beside, Rows, Shape, Unknown, fit};
use crate::identify::grid::Grid;
use crate::smoothing::{weighted, whole};
use crate::two_clocks::{self, Change, NoShift, Shift, Shifts, stands_out};
use nalgebra::{DMatrix, DVector};

/// Rows that the search over whole samples looks at.
const SEARCHED_ROWS: usize = 2000;

/// The shift under which the fit leaves least, within `longest_s`.
pub(super) fn find(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, longest_s: f64) -> Result<Shift, NoShift> {
    let begin_s = search(grid, rows, shape, known_mass, longest_s)?;
    refine(grid, rows, shape, known_mass, begin_s)
        .map(|shifts| shifts.middle)
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
    let shifts = refine(grid, rows, shape, known_mass, begin_s)?;
    Some((shifts.middle, shifts.growth?))
}

/// The shift in the middle of the record, and its growth where the fit has that, from a shift near it.
fn refine(grid: &Grid, rows: &Rows, shape: Shape, known_mass: f64, begin_s: f64) -> Option<Shifts> {
    let shape = Shape {
        has_shift: true,
        ..shape
    };
    two_clocks::refine(begin_s, |shift_s, growth_s| {
        let force = grid.force_shifted(shift_s, growth_s);
        let rates = rows.force_rates(&force);
        let forces = without_inertia(rows, rows.forces(&force), known_mass);
        let beside = Beside {
            rates: &rates,
            ..Beside::default()
        };
        let fit = fit(rows, &forces, beside, shape).ok()?;
        let change = |unknown| Some((fit.value(unknown)?, fit.error(unknown)?));
        Some(Change {
            shift: change(Unknown::Shift)?,
            growth: change(Unknown::ShiftGrowth),
            freedom: fit.found.freedom,
        })
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
    if !stands_out(best.1, most) {
        return Err(NoShift::AllAlike);
    }
    Ok(best.0 as f64 * grid.period_s)
}
