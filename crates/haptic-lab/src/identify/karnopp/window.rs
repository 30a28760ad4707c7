//! Which window the record is seen through.

use super::problem::Problem;
use super::regression::{Rows, Shape, Unknown};
use crate::robust_fit::Unfit;

/// Half-lengths of windows, s: from the slides of a quick stick-slip to those of a slow rig.
const MIN_HALF_S: f64 = 6e-3;
const MAX_HALF_S: f64 = 0.12;

/// Ratio of neighbouring half-lengths.
const RATIO: f64 = 1.35;

/// Fewest samples on either side: with fewer the windows for position and force are no longer alike.
const MIN_REACH: f64 = 6.0;

/// How much wider the intervals may be than under the best window, on the geometric mean.
const MAX_LOSS: f64 = 1.2;
/// The same where the shift of two clocks is fitted: it is told by what a short window lets in as well.
const MAX_LOSS_WITH_SHIFT: f64 = 2.5;

/// The half-lengths that are tried, s.
pub(super) fn candidates(period_s: f64) -> Vec<f64> {
    let shortest = MIN_HALF_S.max(MIN_REACH * period_s);
    let longest = MAX_HALF_S.max(2.0 * shortest);
    std::iter::successors(Some(shortest), |half_s| Some(half_s * RATIO))
        .take_while(|half_s| *half_s <= longest)
        .collect()
}

/// The longest window whose intervals are hardly wider than the narrowest. A short one lets in the
/// encoder's noise and what a rigid mass does not explain; a long one has no place between two rests.
pub(super) fn choose(problem: &Problem<'_>, shape: Shape) -> Result<Rows, Unfit> {
    let mut unfit = Unfit::TooFewRows(0);
    let mut fits = Vec::new();
    for half_s in candidates(problem.grid.period_s) {
        let rows = problem.rows(half_s);
        match problem.fit(&rows, shape) {
            Ok(fit) => {
                let unknowns = shape.unknowns();
                let loss = |unknown: &Unknown| {
                    fit.uncertainty_of(*unknown)
                        .map_or(0.0, |of| of.error)
                        .hypot(fit.bias(&[(*unknown, 1.0)]))
                        .max(f64::MIN_POSITIVE)
                        .ln()
                };
                let score = unknowns.iter().map(loss).sum::<f64>() / unknowns.len() as f64;
                fits.push((score, rows));
            }
            // The first reason is that of the shortest window, under which most rows are left.
            Err(reason) if unfit == Unfit::TooFewRows(0) => unfit = reason,
            Err(_) => {}
        }
    }
    let best = fits.iter().map(|(score, _)| *score).fold(f64::INFINITY, f64::min);
    let loss = if shape.has_shift { MAX_LOSS_WITH_SHIFT } else { MAX_LOSS };
    fits.into_iter()
        .rfind(|(score, _)| *score <= best + loss.ln())
        .map(|(_, rows)| rows)
        .ok_or(unfit)
}
