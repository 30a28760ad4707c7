//! A linear fit with Huber's weights, and errors by leaving out parts.

use crate::median::median;
use crate::stats::mean::student_t_of;
use nalgebra::{DMatrix, DVector};

/// Robust standard deviations up to which a residual counts fully. Wider than Huber's 1.345: what a law does not
/// explain must show in the intervals, and only glitches must be left out.
const FULL_WEIGHT_DEVIATIONS: f64 = 3.0;

/// Parts that are left out one after another. This number holds the slow errors of a record of a dozen strokes,
/// and still gives a variance.
const PARTS: usize = 24;

/// Standard deviations of a normal value that its 95 % interval reaches to either side.
pub(crate) const NORMAL_95: f64 = 1.959_964;

/// Largest condition number of the scaled normal equations.
const LARGEST_CONDITION: f64 = 1e9;

/// A fit, with the covariance of what it found.
#[derive(Clone, Debug)]
pub(crate) struct RobustFit {
    pub(crate) values: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
    /// What it leaves of each row.
    pub(crate) residuals: Vec<f64>,
    /// Degrees of freedom of the covariance.
    pub(crate) freedom: f64,
    /// Each unknown's variance among the rows that the others do not explain, in its coefficient's unit.
    pub(crate) own_variance: Vec<f64>,
}

impl RobustFit {
    /// Standard error of an unknown.
    pub(crate) fn error(&self, unknown: usize) -> f64 {
        self.covariance[(unknown, unknown)].max(0.0).sqrt()
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

/// Fits rows of coefficients, in the order of the record, to their targets.
pub(crate) fn fit(mut design: DMatrix<f64>, target: &[f64]) -> Result<RobustFit, Unfit> {
    let (n, k) = design.shape();
    if n < 2 * PARTS {
        return Err(Unfit::TooFewRows(n));
    }
    let scales: Vec<f64> = (0..k)
        .map(|j| (design.column(j).norm() / (n as f64).sqrt()).max(f64::MIN_POSITIVE))
        .collect();
    for (j, scale) in scales.iter().enumerate() {
        design.column_mut(j).scale_mut(1.0 / scale);
    }
    let target = DVector::from_column_slice(target);
    let WeightedFit {
        weights,
        mut values,
        residuals,
    } = weighted_fit(&design, &target)?;
    let (normal, right) = normal_equations(&design, &target, &weights, 0..n);
    let inverse = normal.clone().try_inverse().ok_or(Unfit::OnePart)?;
    let mut covariance = jackknife(&design, &target, &weights, (&normal, &right))?;
    for i in 0..k {
        values[i] /= scales[i];
        for j in 0..k {
            covariance[(i, j)] /= scales[i] * scales[j];
        }
    }
    let own_variance = (0..k)
        .map(|j| scales[j] * scales[j] / (inverse[(j, j)] * n as f64))
        .collect();
    Ok(RobustFit {
        values,
        covariance,
        residuals: residuals.as_slice().to_vec(),
        freedom: freedom(k),
        own_variance,
    })
}

/// Degrees of freedom of the errors of so many unknowns: parts differ in what they say of one, so that fewer count than
/// there are.
pub(crate) fn freedom(unknowns: usize) -> f64 {
    (PARTS.saturating_sub(unknowns) as f64 / 1.5).max(3.0)
}

/// A fit under Huber's weights.
struct WeightedFit {
    weights: Vec<f64>,
    values: DVector<f64>,
    /// What the values leave of each row.
    residuals: DVector<f64>,
}

/// Repeats the fit until the weights stand still.
fn weighted_fit(design: &DMatrix<f64>, target: &DVector<f64>) -> Result<WeightedFit, Unfit> {
    let (n, k) = design.shape();
    let mut weights = vec![1.0; n];
    let mut values = DVector::zeros(k);
    let mut residuals = target.clone();
    for _ in 0..30 {
        let (normal, right) = normal_equations(design, target, &weights, 0..n);
        let found = solve(&normal, &right)?;
        let change = (&found - &values).amax();
        values = found;
        residuals = target - design * &values;
        let limit = FULL_WEIGHT_DEVIATIONS * robust_deviation(residuals.as_slice());
        for (weight, residual) in weights.iter_mut().zip(residuals.iter()) {
            *weight = (limit / residual.abs().max(f64::MIN_POSITIVE)).min(1.0);
        }
        if change <= 1e-6 * values.amax() {
            break;
        }
    }
    Ok(WeightedFit {
        weights,
        values,
        residuals,
    })
}

/// The covariance by leaving out one part after another.
fn jackknife(
    design: &DMatrix<f64>,
    target: &DVector<f64>,
    weights: &[f64],
    (normal, right): (&DMatrix<f64>, &DVector<f64>),
) -> Result<DMatrix<f64>, Unfit> {
    let (n, k) = design.shape();
    let mut found = Vec::with_capacity(PARTS);
    for part in 0..PARTS {
        let (less, less_right) = normal_equations(design, target, weights, part * n / PARTS..(part + 1) * n / PARTS);
        found.push(solve(&(normal - less), &(right - less_right)).map_err(|_| Unfit::OnePart)?);
    }
    let mean = found.iter().fold(DVector::zeros(k), |sum, each| sum + each) / PARTS as f64;
    let mut covariance = DMatrix::zeros(k, k);
    for each in &found {
        let apart = each - &mean;
        covariance += &apart * apart.transpose();
    }
    Ok(covariance * ((PARTS - 1) as f64 / PARTS as f64))
}

fn normal_equations(
    design: &DMatrix<f64>,
    target: &DVector<f64>,
    weights: &[f64],
    part: std::ops::Range<usize>,
) -> (DMatrix<f64>, DVector<f64>) {
    let k = design.ncols();
    let (mut normal, mut right) = (DMatrix::zeros(k, k), DVector::zeros(k));
    for i in part {
        for a in 0..k {
            let weighted = weights[i] * design[(i, a)];
            right[a] += weighted * target[i];
            for b in 0..k {
                normal[(a, b)] += weighted * design[(i, b)];
            }
        }
    }
    (normal, right)
}

fn solve(normal: &DMatrix<f64>, right: &DVector<f64>) -> Result<DVector<f64>, Unfit> {
    let eigen = normal.clone().symmetric_eigen();
    let (least, largest) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
    let condition = if least > 0.0 { largest / least } else { f64::INFINITY };
    if condition.is_nan() || condition > LARGEST_CONDITION {
        return Err(Unfit::Condition(condition));
    }
    let parts = eigen.eigenvectors.transpose() * right;
    Ok(&eigen.eigenvectors * parts.component_div(&eigen.eigenvalues))
}

/// The standard deviation of normal values, from the median of their sizes.
pub(crate) fn robust_deviation(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    1.4826 * median(&mut sizes).unwrap_or(0.0)
}

/// How many standard errors from 0 a value certainly is not 0: once in 10,000 records it is nevertheless. What a file
/// says by itself, as that a clock drifts, must not be said of those where it is not so.
pub(crate) fn certain(freedom: f64) -> f64 {
    student_t_of(0.9999, freedom)
}
