//! The shift between the clock of the positions and that of the forces, and their drift.
//!
//! The shift that leaves least of the force is found over whole samples first, then within them, as one more unknown of
//! the fit: the force's change with time is its coefficient. Within the strokes of one sine that is a sum of inertia
//! and viscous friction, so that many records do not determine it.

use super::place;
use super::problem::Problem;
use super::regression::{OVERLAPPING, RegressionRow, Rows, Shape, Unknown};
use crate::smoothing::{weighted, whole};
use crate::two_clocks::{self, Change, NoShift, Shift, Shifts, stands_out};
use nalgebra::{DMatrix, DVector};

/// Rows that the search over whole samples looks at.
const SEARCHED_ROWS: usize = 2000;

/// Share of the variance of the force's change, as far as the other unknowns do not explain it, that may be noise.
const MAX_NOISE_SHARE: f64 = 0.2;

/// Fewest degrees of freedom: with fewer a few strokes alone determine the shift, which one wrong stroke would.
const MIN_FREEDOM: f64 = 5.75;
/// But where the noise share is below this it is seen all the same.
const CLEAR_NOISE_SHARE: f64 = 0.125;

/// Another shift must leave more than this by so many times the variance of what is left, times the rows that overlap.
const CLEARLY_MORE: f64 = 25.0;
/// So far from the best one it is looked for, s: the same motion comes again.
const OTHERS_WITHIN_S: f64 = 0.06;

/// The shift under which the fit leaves least, within `longest_s`, however little determines it.
pub(super) fn rough(problem: &Problem<'_>, rows: &Rows, shape: Shape, longest_s: f64) -> Result<Shift, NoShift> {
    Search::new(problem, rows, shape, longest_s)?.refined(shape, longest_s)
}

/// The shift that the record determines, within `longest_s`, s.
pub(super) fn find(problem: &Problem<'_>, rows: &Rows, shape: Shape, longest_s: f64) -> Result<f64, NoShift> {
    let search = Search::new(problem, rows, shape, longest_s)?;
    let shift = search.refined(shape, longest_s)?;
    if shift.value_s.abs() + shift.reach_95_s > longest_s {
        return Err(NoShift::OutOfReach);
    }
    let fit = problem
        .with_force(problem.grid.force_shifted(shift.value_s, 0.0))
        .fit(rows, shape)
        .map_err(|_| NoShift::OutOfReach)?;
    let noise_share = fit.noise_share(Unknown::Shift).unwrap_or(1.0);
    let freedom = fit.uncertainty_of(Unknown::Shift).map_or(0.0, |of| of.freedom);
    let is_noise = noise_share > MAX_NOISE_SHARE || (freedom < MIN_FREEDOM && noise_share > CLEAR_NOISE_SHARE);
    if is_noise || place::one_frequency(problem, rows).is_some() {
        return Err(NoShift::Noise);
    }
    search.only(&shift)?;
    Ok(shift.value_s)
}

/// The shift in the middle of the record, and by how much it grows from the first sample to the last; `None` where they
/// cannot be found.
pub(super) fn growing(problem: &Problem<'_>, rows: &Rows, shape: Shape, longest_s: f64) -> Option<(Shift, Shift)> {
    let begin_s = Search::new(problem, rows, shape, longest_s).ok()?.best().ok()?;
    let shape = Shape {
        has_growing_shift: true,
        ..shape
    };
    let shifts = refine(problem, rows, shape, begin_s)?;
    Some((shifts.middle, shifts.growth?))
}

/// The shift in the middle of the record, and its growth where the fit has that, from a shift near it.
fn refine(problem: &Problem<'_>, rows: &Rows, shape: Shape, begin_s: f64) -> Option<Shifts> {
    two_clocks::refine(begin_s, |shift_s, growth_s| {
        let shifted = problem.with_force(problem.grid.force_shifted(shift_s, growth_s));
        let fit = shifted.fit(rows, shape).ok()?;
        let change = |unknown| Some((fit.value(unknown)?, fit.uncertainty_of(unknown)?));
        Some(Change {
            shift: change(Unknown::Shift)?,
            growth: change(Unknown::ShiftGrowth),
        })
    })
}

/// What is left under shifts by whole samples.
struct Search<'a> {
    problem: &'a Problem<'a>,
    rows: &'a Rows,
    thinned: Vec<RegressionRow>,
    /// Of so many rows one is looked at.
    every: usize,
    design: DMatrix<f64>,
    inverse: DMatrix<f64>,
    longest: isize,
}

impl<'a> Search<'a> {
    fn new(problem: &'a Problem<'a>, rows: &'a Rows, shape: Shape, longest_s: f64) -> Result<Self, NoShift> {
        let longest = whole((longest_s / problem.grid.period_s).ceil());
        let reach = longest + rows.window.reach;
        let every = rows.rows.len().div_ceil(SEARCHED_ROWS).max(1);
        let thinned: Vec<_> = rows
            .rows
            .iter()
            .step_by(every)
            .filter(|row| row.at >= reach && row.at + reach < problem.grid.len())
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
        Ok(Self {
            inverse: design.tr_mul(&design).try_inverse().ok_or(NoShift::OutOfReach)?,
            longest: isize::try_from(longest).unwrap_or(isize::MAX),
            problem,
            rows,
            thinned,
            every,
            design,
        })
    }

    /// Squares that the fit under a shift leaves, N^2.
    fn left(&self, shift: isize) -> f64 {
        let Problem { grid, known_mass, .. } = self.problem;
        let forces = DVector::from_iterator(
            self.thinned.len(),
            self.thinned.iter().map(|row| {
                let at = row.at.saturating_add_signed(shift);
                weighted(&self.rows.window.mean, &grid.force_n, at, 0.0) - known_mass * row.acceleration
            }),
        );
        let right = self.design.tr_mul(&forces);
        forces.norm_squared() - right.dot(&(&self.inverse * &right))
    }

    fn shifts(&self) -> impl Iterator<Item = isize> {
        (-self.longest..=self.longest).step_by((self.rows.window.reach / 8).max(1))
    }

    /// The best shift, s.
    fn best(&self) -> Result<f64, NoShift> {
        let mut best = (0, f64::INFINITY);
        let mut most = 0.0_f64;
        for shift in self.shifts() {
            let left = self.left(shift);
            most = most.max(left);
            if left < best.1 {
                best = (shift, left);
            }
        }
        if !stands_out(best.1, most) {
            return Err(NoShift::AllAlike);
        }
        Ok(best.0 as f64 * self.problem.grid.period_s)
    }

    /// The best shift within samples as well.
    fn refined(&self, shape: Shape, longest_s: f64) -> Result<Shift, NoShift> {
        refine(self.problem, self.rows, shape, self.best()?)
            .map(|shifts| shifts.middle)
            .filter(|shift| shift.value_s.abs() <= longest_s)
            .ok_or(NoShift::OutOfReach)
    }

    /// Whether every other shift in the neighbourhood leaves clearly more.
    fn only(&self, best: &Shift) -> Result<(), NoShift> {
        let period_s = self.problem.grid.period_s;
        let apart_s = |shift: &isize| (*shift as f64 * period_s - best.value_s).abs();
        let near_s = (3.0 * best.reach_95_s).max(self.rows.half_s / 4.0);
        let nearest = self.shifts().min_by(|one, two| apart_s(one).total_cmp(&apart_s(two)));
        let least = self.left(nearest.unwrap_or(0));
        let overlapping = (OVERLAPPING / self.every as f64).max(1.0);
        let more = CLEARLY_MORE * overlapping * least / self.thinned.len() as f64;
        let other = self
            .shifts()
            .filter(|shift| (near_s..OTHERS_WITHIN_S).contains(&apart_s(shift)))
            .find(|shift| self.left(*shift) < least + more);
        other.map_or(Ok(()), |other| Err(NoShift::Other(other as f64 * period_s)))
    }
}
