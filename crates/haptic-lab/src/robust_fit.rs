//! A linear fit with Huber's weights, and errors by leaving out parts.
//!
//! Noise of the coefficients, which would draw the values to zero, is taken out of the normal equations by its variance
//! (Fuller 1987, section 2.2). Neighbouring parts that err alike widen the errors (Newey and West 1987, of one lag),
//! and parts that differ in what they say of a value have fewer degrees of freedom (Satterthwaite 1946).

use crate::stats::mean::{student_t, student_t_of};
use haptic_motion::median::median;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Robust standard deviations up to which a residual counts fully. Wider than Huber's 1.345: what a law does not
/// explain must show in the intervals, and only glitches must be left out.
const FULL_WEIGHT_DEVIATIONS: f64 = 3.0;

/// Parts that are left out one after another. This number holds the slow errors of a record of a dozen strokes,
/// and still gives a variance.
pub(crate) const PARTS: usize = 24;

/// Standard deviations of a normal value that its 95 % interval reaches to either side.
pub(crate) const NORMAL_95: f64 = 1.959_964;

/// Largest condition number of the scaled normal equations.
const MAX_CONDITION: f64 = 1e9;

/// A fit, with what its errors follow from.
#[derive(Clone, Debug)]
pub(crate) struct RobustFit {
    pub(crate) values: DVector<f64>,
    /// What it leaves of each row.
    pub(crate) residuals: Vec<f64>,
    /// Each unknown's variance among the rows that the others do not explain, in its coefficient's unit, its noise
    /// taken out.
    pub(crate) own_variance: Vec<f64>,
    /// The variance of each coefficient's noise, as a share of the unknown's own variance.
    pub(crate) noise_share: Vec<f64>,
    /// What taking the coefficients' noise out has added to the values.
    pub(crate) noise_pull: DVector<f64>,
    parts: Vec<Part>,
}

/// What a part of the record says, in the unknowns' units.
#[derive(Clone, Debug)]
struct Part {
    /// Its number.
    part: usize,
    /// The values without it, less their mean over the parts.
    without: DVector<f64>,
    /// What its residuals add to the values.
    pull: DVector<f64>,
    /// What it says of the values: the inverse of the whole normal equations, times its own, times that inverse.
    share: DMatrix<f64>,
}

/// How far a value may be from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Uncertainty {
    /// Standard error.
    pub(crate) error: f64,
    /// Degrees of freedom of that.
    pub(crate) freedom: f64,
}

impl Uncertainty {
    /// Half of the 95 % interval.
    pub(crate) fn reach_95(self) -> f64 {
        student_t(self.freedom) * self.error
    }

    /// How far from 0 a value is certainly not 0: once in 10,000 records it is nevertheless. A note on a file, as
    /// that a clock drifts, must not appear where it is not so.
    pub(crate) fn reach_certain(self) -> f64 {
        student_t_of(0.9999, self.freedom) * self.error
    }
}

impl RobustFit {
    /// The uncertainty of a sum of the unknowns with factors.
    pub(crate) fn uncertainty(&self, factors: &DVector<f64>) -> Uncertainty {
        let count = self.parts.len() as f64;
        let of_parts = |of: &dyn Fn(&Part) -> f64| self.parts.iter().map(of).collect::<Vec<f64>>();
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let pulls = of_parts(&|part| factors.dot(&part.pull));
        let alike: f64 = pulls.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let alike = (1.0 + alike / squares(&pulls).max(f64::MIN_POSITIVE)).max(1.0);
        let without = squares(&of_parts(&|part| factors.dot(&part.without)));
        let shares = of_parts(&|part| factors.dot(&(&part.share * factors)));
        let whole: f64 = shares.iter().sum();
        Uncertainty {
            error: ((count - 1.0) / count * without * alike).sqrt(),
            freedom: (whole * whole / squares(&shares).max(f64::MIN_POSITIVE) - 1.0).max(1.0),
        }
    }

    /// The standard error of how much a sum of the unknowns differs in a fit to some of the same rows.
    pub(crate) fn error_of_difference(&self, other: &Self, factors: &DVector<f64>) -> f64 {
        let count = self.parts.len() as f64;
        let of_other = |part: usize| other.parts.iter().find(|other| other.part == part);
        let differences: Vec<f64> = self
            .parts
            .iter()
            .map(|part| {
                let theirs = of_other(part.part).map_or(0.0, |other| factors.dot(&other.without));
                factors.dot(&part.without) - theirs
            })
            .collect();
        let mean = differences.iter().sum::<f64>() / count;
        let squares: f64 = differences.iter().map(|difference| (difference - mean).powi(2)).sum();
        ((count - 1.0) / count * squares).sqrt()
    }

    /// The uncertainty of an unknown.
    pub(crate) fn uncertainty_of(&self, unknown: usize) -> Uncertainty {
        let mut factors = DVector::zeros(self.values.len());
        factors[unknown] = 1.0;
        self.uncertainty(&factors)
    }
}

/// Why a fit cannot be made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Unfit {
    /// Fewer rows than a fit with errors needs.
    TooFewRows(usize),
    /// The rows do not separate the unknowns: condition number.
    Condition(f64),
    /// Without one part of the record the rows do not separate the unknowns.
    OnePart,
}

/// Parts of equal size, for each of so many rows.
pub(crate) fn equal_parts(rows: usize) -> Vec<usize> {
    (0..rows).map(|row| row * PARTS / rows).collect()
}

/// Fits rows of coefficients to their targets. `noise` has the variance of each coefficient's noise, in its unit, and
/// `part_of` the part that each row belongs to, which does not fall.
pub(crate) fn fit(
    mut design: DMatrix<f64>,
    target: &[f64],
    noise: &[f64],
    part_of: &[usize],
) -> Result<RobustFit, Unfit> {
    let (n, k) = design.shape();
    if n < 2 * PARTS {
        return Err(Unfit::TooFewRows(n));
    }
    let scales = DVector::from_fn(k, |j, _| {
        (design.column(j).norm() / (n as f64).sqrt()).max(f64::MIN_POSITIVE)
    });
    for (j, scale) in scales.iter().enumerate() {
        design.column_mut(j).scale_mut(1.0 / scale);
    }
    let rows = WeightedRows {
        noise: DVector::from_fn(k, |j, _| noise[j] / (scales[j] * scales[j])),
        target: DVector::from_column_slice(target),
        weights: vec![1.0; n],
        design,
    };
    let (rows, values, residuals) = rows.weighted()?;
    let (normal, right) = rows.normal(0..n);
    let inverse = normal.clone().try_inverse().ok_or(Unfit::OnePart)?;
    let mut parts = rows.parts(part_of, &residuals, (&normal, &right, &inverse))?;
    for part in &mut parts {
        part.without.component_div_assign(&scales);
        part.pull.component_div_assign(&scales);
        part.share.component_div_assign(&(&scales * scales.transpose()));
    }
    let own_variance: Vec<f64> = (0..k)
        .map(|j| scales[j] * scales[j] / (inverse[(j, j)] * n as f64))
        .collect();
    let weight: f64 = rows.weights.iter().sum();
    let noise_pull = weight * inverse * rows.noise.component_mul(&values);
    Ok(RobustFit {
        noise_pull: noise_pull.component_div(&scales),
        noise_share: noise
            .iter()
            .zip(&own_variance)
            .map(|(noise, own)| noise / own)
            .collect(),
        own_variance,
        values: values.component_div(&scales),
        residuals: residuals.as_slice().to_vec(),
        parts,
    })
}

/// Rows of a fit, under weights.
struct WeightedRows {
    design: DMatrix<f64>,
    target: DVector<f64>,
    noise: DVector<f64>,
    weights: Vec<f64>,
}

impl WeightedRows {
    /// Repeats the fit until Huber's weights stand still: the values, and what they leave of each row.
    fn weighted(mut self) -> Result<(Self, DVector<f64>, DVector<f64>), Unfit> {
        let (n, k) = self.design.shape();
        let mut values = DVector::zeros(k);
        let mut residuals = self.target.clone();
        for _ in 0..30 {
            let (normal, right) = self.normal(0..n);
            let found = solve(&normal, &right)?;
            let change = (&found - &values).amax();
            values = found;
            residuals = &self.target - &self.design * &values;
            let limit = FULL_WEIGHT_DEVIATIONS * robust_deviation(residuals.as_slice());
            for (weight, residual) in self.weights.iter_mut().zip(residuals.iter()) {
                *weight = (limit / residual.abs().max(f64::MIN_POSITIVE)).min(1.0);
            }
            if change <= 1e-6 * values.amax() {
                break;
            }
        }
        Ok((self, values, residuals))
    }

    /// Leaves out one part after another, of all normal equations, whose inverse is given as well.
    fn parts(
        &self,
        part_of: &[usize],
        residuals: &DVector<f64>,
        (normal, right, inverse): (&DMatrix<f64>, &DVector<f64>, &DMatrix<f64>),
    ) -> Result<Vec<Part>, Unfit> {
        let mut parts = Vec::new();
        let mut begin = 0;
        for rows in part_of.chunk_by(|one, two| one == two) {
            let range = begin..begin + rows.len();
            begin = range.end;
            let (own, own_right) = self.normal(range.clone());
            let weights = DVector::from_column_slice(&self.weights[range.clone()]);
            let left = residuals.rows_range(range.clone()).component_mul(&weights);
            let pull = self.design.rows_range(range).tr_mul(&left);
            parts.push(Part {
                part: rows[0],
                without: solve(&(normal - &own), &(right - own_right)).map_err(|_| Unfit::OnePart)?,
                pull: inverse * pull,
                share: inverse * own * inverse,
            });
        }
        let mean = parts
            .iter()
            .fold(DVector::zeros(right.len()), |sum, part| sum + &part.without)
            / parts.len() as f64;
        parts.iter_mut().for_each(|part| part.without -= &mean);
        Ok(parts)
    }

    /// The normal equations of some rows.
    fn normal(&self, rows: Range<usize>) -> (DMatrix<f64>, DVector<f64>) {
        let design = self.design.rows_range(rows.clone());
        let mut weighted = design.clone_owned();
        let weights = &self.weights[rows.clone()];
        for mut column in weighted.column_iter_mut() {
            column
                .iter_mut()
                .zip(weights)
                .for_each(|(cell, weight)| *cell *= weight);
        }
        let mut normal = weighted.tr_mul(&design);
        let noise = weights.iter().sum::<f64>() * &self.noise;
        normal.set_diagonal(&(normal.diagonal() - noise));
        (normal, weighted.tr_mul(&self.target.rows_range(rows)))
    }
}

fn solve(normal: &DMatrix<f64>, right: &DVector<f64>) -> Result<DVector<f64>, Unfit> {
    let factor = normal.clone().cholesky().ok_or(Unfit::Condition(f64::INFINITY))?;
    let pivots = factor.l_dirty().diagonal();
    let condition = (pivots.max() / pivots.min()).powi(2);
    if condition > MAX_CONDITION {
        return Err(Unfit::Condition(condition));
    }
    Ok(factor.solve(right))
}

/// The standard deviation of normal values, from the median of their sizes.
pub(crate) fn robust_deviation(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    1.4826 * median(&mut sizes).unwrap_or(0.0)
}
