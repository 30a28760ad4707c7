//! The largest likelihood: the least sum of squared deviance residuals, which the solver for least squares finds.

use super::function::{DEVIATIONS_IN_WIDTH, GUESS, Level, MAX_LAPSE, Psychometric, WIDTHS, normal_cdf};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

/// No share is taken as surer than this.
const SURE: f64 = 1e-12;

/// Twice the log-likelihood that a share of correct answers loses against the share that was seen.
pub(super) fn deviance(level: &Level, correct: f64, wrong: f64) -> f64 {
    let (trials, hits) = (f64::from(level.trials), f64::from(level.correct));
    let term = |count: f64, share: f64| {
        if count > 0.0 {
            count * (count / (trials * share.max(SURE))).ln()
        } else {
            0.0
        }
    };
    (2.0 * (term(hits, correct) + term(trials - hits, wrong))).max(0.0)
}

/// The parameters as the solver moves them, where nothing is out of bounds: threshold, logarithm of sigma, and the
/// angle whose squared sine is the share of [`MAX_LAPSE`].
struct Problem<'a> {
    levels: &'a [Level],
    values: DVector<f64>,
    /// Bounds of the logarithm of sigma.
    log_sigma: [f64; 2],
    /// The lapse, where it is not fitted.
    lapse: Option<f64>,
    /// What else is not fitted.
    held: Option<Held>,
}

/// A parameter that stays where a search begins, while the others are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Held {
    Threshold,
    Width,
}

impl Problem<'_> {
    fn sigma(&self) -> f64 {
        self.values[1].clamp(self.log_sigma[0], self.log_sigma[1]).exp()
    }

    fn lapse(&self) -> f64 {
        self.lapse.unwrap_or_else(|| MAX_LAPSE * self.values[2].sin().powi(2))
    }

    /// Probabilities of a correct and of a wrong answer.
    fn shares(&self, level: &Level) -> (f64, f64) {
        let z = (level.level - self.values[0]) / self.sigma();
        let rise = 1.0 - GUESS - self.lapse();
        (GUESS + rise * normal_cdf(z), self.lapse() + rise * normal_cdf(-z))
    }

    fn deviance(&self) -> f64 {
        let of = |level: &Level| {
            let (correct, wrong) = self.shares(level);
            deviance(level, correct, wrong)
        };
        self.levels.iter().map(of).sum()
    }

    /// The signed root of a level's deviance, and how it changes with the probability of a correct answer.
    fn residual(&self, level: &Level) -> (f64, f64) {
        /// Below this share of the variance of one answer, the first order of the root is exact to 1e-4, and the
        /// deviance, a difference of logarithms, loses its digits.
        const NEAR: f64 = 1e-4;
        let (correct, wrong) = self.shares(level);
        let (correct, wrong) = (correct.max(SURE), wrong.max(SURE));
        let trials = f64::from(level.trials);
        let over = f64::from(level.correct) - trials * correct;
        let variance = correct * wrong;
        if over.abs() <= NEAR * trials * variance {
            let slope = -(trials / variance).sqrt();
            return (-slope * over / trials, slope);
        }
        let residual = deviance(level, correct, wrong).sqrt().copysign(over);
        (residual, -over / (variance * residual))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, values: &DVector<f64>) {
        self.values.copy_from(values);
    }

    fn params(&self) -> DVector<f64> {
        self.values.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let of = |level: &Level| self.residual(level).0;
        let residuals = DVector::from_iterator(self.levels.len(), self.levels.iter().map(of));
        residuals
            .iter()
            .all(|residual| residual.is_finite())
            .then_some(residuals)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.levels.len(), self.values.len());
        let (sigma, rise) = (self.sigma(), 1.0 - GUESS - self.lapse());
        let is_bounded = !(self.log_sigma[0]..=self.log_sigma[1]).contains(&self.values[1]);
        let has_slope = [
            self.held != Some(Held::Threshold),
            self.held != Some(Held::Width) && !is_bounded,
        ];
        for (level, mut row) in self.levels.iter().zip(jacobian.row_iter_mut()) {
            let z = (level.level - self.values[0]) / sigma;
            let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
            let slope = self.residual(level).1;
            row[0] = if has_slope[0] {
                -slope * rise * density / sigma
            } else {
                0.0
            };
            row[1] = if has_slope[1] { -slope * rise * density * z } else { 0.0 };
            if self.lapse.is_none() {
                row[2] = -slope * normal_cdf(z) * MAX_LAPSE * (2.0 * self.values[2]).sin();
            }
        }
        Some(jacobian)
    }
}

/// The best function: from the lowest places of a grid, and from a start where there is one.
pub(super) fn best(levels: &[Level], start: Option<&Psychometric>) -> Psychometric {
    let levels = tested(levels);
    let [_, extent] = span(&levels);
    let mut starts = lowest_of_grid(&levels);
    if let Some(start) = start {
        starts.truncate(STARTS_BESIDE_ONE);
        starts.push([start.threshold, start.width]);
    }
    likeliest(&levels, extent, starts, None)
}

/// The likeliest function of this threshold, or of this width.
pub(super) fn best_of(levels: &[Level], held: Held, value: f64) -> Psychometric {
    let levels = &tested(levels);
    let [_, extent] = span(levels);
    let mut starts: Vec<[f64; 2]> = match held {
        Held::Threshold => GRID_WIDTHS.map(|share| [value, share * extent]).to_vec(),
        Held::Width => thresholds_of_grid(levels, value)
            .map(|threshold| [threshold, value])
            .collect(),
    };
    let deviance_of = |[threshold, width]: &[f64; 2]| grid_deviance(levels, *threshold, *width);
    starts.sort_by(|a, b| deviance_of(a).total_cmp(&deviance_of(b)));
    starts.truncate(STARTS_BESIDE_ONE);
    likeliest(levels, extent, starts, Some(held))
}

/// The likeliest of the functions that are found from some starts. The lapse is fitted, and also held at either bound,
/// where the angle of the solver has no slope.
fn likeliest(levels: &[Level], extent: f64, starts: Vec<[f64; 2]>, held: Option<Held>) -> Psychometric {
    let starts = starts.into_iter();
    starts
        .flat_map(|start| [None, Some(0.0), Some(MAX_LAPSE)].map(|lapse| (start, lapse)))
        .map(|(start, lapse)| solved(levels, extent, start, lapse, held))
        .min_by(|a, b| a.deviance.total_cmp(&b.deviance))
        .unwrap_or(Psychometric {
            threshold: f64::NAN,
            width: f64::NAN,
            lapse: 0.0,
            deviance: f64::NAN,
        })
}

/// The levels that have answers: of another nothing has a slope.
fn tested(levels: &[Level]) -> Vec<Level> {
    levels.iter().filter(|level| level.trials > 0).copied().collect()
}

/// Lowest level and extent.
pub(super) fn span(levels: &[Level]) -> [f64; 2] {
    let (low, high) = levels.iter().fold((f64::MAX, f64::MIN), |(low, high), one| {
        (low.min(one.level), high.max(one.level))
    });
    [low, high - low]
}

/// Widths of the grid, as shares of the extent of the levels: the narrowest is a jump.
const GRID_WIDTHS: [f64; 9] = [2e-3, 0.02, 0.06, 0.15, 0.35, 0.8, 2.0, 6.0, 30.0];
/// Steps of the grid over the extent; it goes on by half of that at either end.
const GRID_STEPS: i32 = 12;
/// Lapses of the grid.
const GRID_LAPSES: [f64; 3] = [0.0, 0.03, MAX_LAPSE];
/// Of each width, how many of its best thresholds are starts.
const STARTS_OF_WIDTH: usize = 2;
/// How many of all are, where there is a start that is nearly right.
const STARTS_BESIDE_ONE: usize = 3;

/// Threshold and width where the deviance of a grid is least, for each width, the best first: the likelihood of few
/// answers has several tops, and one that is narrow stands at a level.
fn lowest_of_grid(levels: &[Level]) -> Vec<[f64; 2]> {
    let [_, extent] = span(levels);
    let mut starts = Vec::with_capacity(GRID_WIDTHS.len() * STARTS_OF_WIDTH);
    for width in GRID_WIDTHS.map(|share| share * extent) {
        let mut found: Vec<(f64, f64)> = thresholds_of_grid(levels, width)
            .map(|threshold| (grid_deviance(levels, threshold, width), threshold))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.dedup_by(|a, b| (a.1 - b.1).abs() < width);
        let lowest = found.into_iter().take(STARTS_OF_WIDTH);
        starts.extend(lowest.map(|(deviance, threshold)| (deviance, [threshold, width])));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.into_iter().map(|(_, start)| start).collect()
}

fn thresholds_of_grid(levels: &[Level], width: f64) -> impl Iterator<Item = f64> {
    let [low, extent] = span(levels);
    let even =
        (-GRID_STEPS / 2..=3 * GRID_STEPS / 2).map(move |step| low + extent * f64::from(step) / f64::from(GRID_STEPS));
    // A function that is narrower than the grid is fine can only rise at a level, a little before or after it.
    let narrow = levels
        .iter()
        .filter(move |_| width * f64::from(GRID_STEPS) < extent)
        .flat_map(move |level| [-0.25, 0.0, 0.25].map(|share| level.level + share * width));
    even.chain(narrow)
}

/// The least deviance of a threshold and a width among the lapses of the grid.
fn grid_deviance(levels: &[Level], threshold: f64, width: f64) -> f64 {
    let at = |lapse: f64| -> f64 {
        let function = Psychometric {
            threshold,
            width,
            lapse,
            deviance: 0.0,
        };
        let of = |level: &Level| {
            let correct = function.probability(level.level);
            deviance(level, correct, 1.0 - correct)
        };
        levels.iter().map(of).sum()
    };
    GRID_LAPSES.into_iter().map(at).fold(f64::INFINITY, f64::min)
}

fn solved(
    levels: &[Level],
    extent: f64,
    [threshold, width]: [f64; 2],
    lapse: Option<f64>,
    held: Option<Held>,
) -> Psychometric {
    let log_sigma = WIDTHS.map(|share| (share * extent / DEVIATIONS_IN_WIDTH).ln());
    let mut values = vec![
        threshold,
        (width / DEVIATIONS_IN_WIDTH).ln().clamp(log_sigma[0], log_sigma[1]),
    ];
    if lapse.is_none() {
        values.push(std::f64::consts::FRAC_PI_4);
    }
    let problem = Problem {
        levels,
        values: DVector::from_vec(values),
        log_sigma,
        lapse,
        held,
    };
    let (problem, _) = LevenbergMarquardt::new().with_patience(30).minimize(problem);
    Psychometric {
        threshold: problem.values[0],
        width: problem.sigma() * DEVIATIONS_IN_WIDTH,
        lapse: problem.lapse(),
        deviance: problem.deviance(),
    }
}
