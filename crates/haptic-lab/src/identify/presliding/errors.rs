//! Expected errors of the rows, and weights that make them alike and independent.
//!
//! The force has white noise. What the encoder's steps leave of the position's error, the law makes a force of where it
//! is steep. And where exactly the motion turned, within a step, nobody knows: that moves the whole stroke after it
//! along the law, so that its rows err together.
//!
//! ```text
//! variance of row j = force^2 + (position k_j)^2          covariance within a stroke += (turn)^2 k_i k_j
//! ```
//!
//! `k` is the slope of the friction over the position under the test function.

use super::path::Path;
use haptic_motion::median::median;

/// Root mean square of where a turn was, in steps of the encoder: anywhere within one.
const TURN_STEPS: f64 = 0.29;
/// Steps of the encoder by which a motion must go back to count as a turn.
const STEPS_OF_A_TURN: f64 = 1.0;
/// Rows with less than this share of the steepest slope show the error of the force alone.
const FLAT: f64 = 0.01;
/// Fewest such rows.
const MIN_FLAT: usize = 50;
/// The median of the square of a normal variable over its mean.
const MEDIAN_OF_SQUARES: f64 = 0.455;

/// The errors to be expected.
#[derive(Clone, Debug)]
pub(crate) struct Errors {
    /// By how much each row counts.
    weights: Vec<f64>,
    /// The row's slope over the weight that a row without slope has, in units of the turn's error.
    along: Vec<f64>,
    /// The stroke to which each row belongs.
    stroke: Vec<usize>,
}

impl Errors {
    /// Of rows that are alike.
    pub(crate) fn alike(rows: usize) -> Self {
        Self {
            weights: vec![1.0; rows],
            along: vec![0.0; rows],
            stroke: vec![0; rows],
        }
    }

    /// As the residual of a fit shows them, with the slopes and the middle samples of its rows; `None` where too few
    /// rows slide.
    pub(crate) fn of(residual: &[f64], slopes: &[f64], middles: &[usize], path: &Path) -> Option<Self> {
        let steepest = slopes.iter().copied().fold(0.0, f64::max);
        let flat = residual
            .iter()
            .zip(slopes)
            .filter(|(_, slope)| **slope < FLAT * steepest);
        let mut squares: Vec<f64> = flat.map(|(left, _)| left * left).collect();
        if squares.len() < MIN_FLAT {
            return None;
        }
        let of_force = (median(&mut squares)? / MEDIAN_OF_SQUARES).max(1e-24);
        let turns = path.turns(STEPS_OF_A_TURN * path.resolution_m.max(1e-9));
        let of_turn = (TURN_STEPS * path.resolution_m).powi(2) / of_force;
        let mut errors = Self {
            weights: vec![1.0; slopes.len()],
            along: slopes.iter().map(|slope| slope * of_turn.sqrt()).collect(),
            stroke: middles
                .iter()
                .map(|middle| turns.partition_point(|turn| turn <= middle))
                .collect(),
        };
        // What the turns do not explain is the position's own.
        let mut left = residual.to_vec();
        errors.whiten(&(0..left.len()).collect::<Vec<usize>>(), &mut left);
        let (mut above, mut below) = (0.0, 0.0);
        for (left, slope) in left.iter().zip(slopes) {
            above += (left * left - of_force) * slope * slope;
            below += slope.powi(4);
        }
        let of_position = (above / below.max(1e-300)).max(0.0);
        let share = |slope: &f64| (of_force / (of_force + of_position * slope * slope)).sqrt();
        errors.weights = slopes.iter().map(share).collect();
        Some(errors)
    }

    /// Makes values of the rows that are kept count as if their errors were alike and independent: the inverse of the
    /// covariance's root, which is the unit matrix and one direction a stroke.
    pub(crate) fn whiten(&self, kept: &[usize], values: &mut [f64]) {
        let mut first = 0;
        while first < kept.len() {
            let stroke = self.stroke[kept[first]];
            let many = kept[first..]
                .iter()
                .take_while(|&&row| self.stroke[row] == stroke)
                .count();
            let rows = &kept[first..first + many];
            let (mut square, mut product) = (0.0, 0.0);
            for (value, &row) in values[first..].iter_mut().zip(rows) {
                let along = self.along[row] * self.weights[row];
                *value *= self.weights[row];
                square += along * along;
                product += along * *value;
            }
            if square > 0.0 {
                let taken = product * (1.0 - 1.0 / (1.0 + square).sqrt()) / square;
                for (value, &row) in values[first..].iter_mut().zip(rows) {
                    *value -= taken * self.along[row] * self.weights[row];
                }
            }
            first += many;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitened_errors_have_the_variance_of_one_row() {
        let errors = Errors {
            weights: vec![1.0, 0.5, 1.0],
            along: vec![3.0, 4.0, 0.0],
            stroke: vec![0, 0, 1],
        };
        // Along the turn's direction the variance is 1 + 9 + 4, across it 1.
        let mut along = [3.0, 4.0, 2.0];
        errors.whiten(&[0, 1, 2], &mut along);
        let share = 1.0 / 14_f64.sqrt();
        assert!((along[0] - 3.0 * share).abs() < 1e-12 && (along[1] - 2.0 * share).abs() < 1e-12);
        let mut across = [2.0, -6.0, 1.0];
        errors.whiten(&[0, 1, 2], &mut across);
        assert_eq!(across, [2.0, -3.0, 1.0]);
    }
}
