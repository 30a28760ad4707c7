//! Least squares of the force under test functions, over logarithms where a parameter is positive, by Levenberg and
//! Marquardt.

use super::super::options::Options;
use super::super::result::{Identified, ModelKind};
use super::errors::Errors;
use super::laws::{Course, PathLaw};
use super::path::Path;
use super::weak::TestFunctions;
use crate::motion;
use crate::stats::mean::rms;
use haptic_motion::median::extent;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

/// Steps of the encoder by which positions must change under a test function to be in sight.
const STEPS_IN_SIGHT: f64 = 2.0;

/// What the equation of motion holds under each test function.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    functions: TestFunctions,
    force: Vec<f64>,
    /// How fast the force changes, N/s.
    rate: Vec<f64>,
    acceleration: Vec<f64>,
    /// Velocity along each direction, the other way zero.
    velocity: [Vec<f64>; 2],
    /// Whether the position changes in sight.
    pub(crate) moves: Vec<bool>,
    /// Expected error of each.
    pub(crate) errors: Errors,
}

impl Rows {
    /// The rows of a path.
    pub(crate) fn new(path: &Path, stride: usize) -> Self {
        let functions = TestFunctions::new(path, stride);
        let along: Vec<f64> = path.speed_mps.iter().map(|speed| speed.max(0.0)).collect();
        let against: Vec<f64> = path.speed_mps.iter().map(|speed| speed.min(0.0)).collect();
        let moves: Vec<bool> = (0..functions.middles.len())
            .map(|row| {
                let positions = path.smooth_m[functions.samples(row)].iter().copied();
                let (low, high) = extent(positions);
                high - low > STEPS_IN_SIGHT * path.resolution_m.max(1e-12)
            })
            .collect();
        Self {
            force: functions.of_force(&path.force_n),
            rate: functions.of_force(&path.force_rates()),
            acceleration: functions.of_position(&path.counted_m),
            velocity: [functions.of_force(&along), functions.of_force(&against)],
            errors: Errors::alike(moves.len()),
            moves,
            functions,
        }
    }

    /// Length of the test functions, s.
    pub(crate) fn window_s(&self) -> f64 {
        self.functions.window_s()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.force.len()
    }

    /// Those in which the position changes in sight.
    pub(crate) fn moving(&self) -> Vec<usize> {
        (0..self.len()).filter(|&row| self.moves[row]).collect()
    }

    /// The sample in the middle of a row.
    pub(crate) fn middle(&self, row: usize) -> usize {
        self.functions.middles[row]
    }

    /// Expects the errors that a fit shows.
    pub(crate) fn weigh(&mut self, path: &Path, fit: &Fit) {
        let Estimate { law, values, .. } = &fit.estimate;
        let tangent = law.tangent(values, path, &law.along(values, path).friction_n);
        if let Some(errors) = Errors::of(
            &fit.residual,
            &self.functions.of_force(&tangent),
            &self.functions.middles,
            path,
        ) {
            self.errors = errors;
        }
    }

    /// Root mean square of the acceleration, m/s^2.
    pub(crate) fn acceleration_rms(&self) -> f64 {
        rms(self.acceleration.iter().copied())
    }

    /// Root mean square of the force about its mean, N.
    pub(crate) fn force_rms(&self) -> f64 {
        let count = self.len().max(1) as f64;
        let mean = self.force.iter().sum::<f64>() / count;
        (self.force.iter().map(|force| (force - mean).powi(2)).sum::<f64>() / count).sqrt()
    }

    /// Values of the rows at each of a number of samples, along straight lines between the middles of the rows.
    pub(crate) fn at_samples(&self, values: &[f64], samples: usize) -> Vec<f64> {
        let middles: Vec<f64> = self.functions.middles.iter().map(|&middle| middle as f64).collect();
        let places = motion::places(&middles, (0..samples).map(|sample| sample as f64));
        places.map(|place| motion::between(values, place)).collect()
    }
}

/// What is assumed, and so not fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Assumptions {
    /// Mass, kg, where it is known.
    pub(crate) mass_kg: Option<f64>,
    /// Constant force, N, where it is known.
    pub(crate) offset_n: Option<f64>,
    /// Whether friction is the same in both directions.
    pub(crate) alike: bool,
    /// Whether both clocks are the same.
    pub(crate) one_clock: bool,
}

impl Assumptions {
    /// What is known beforehand.
    pub(crate) const fn of(options: &Options, alike: bool) -> Self {
        Self {
            mass_kg: options.mass_kg,
            offset_n: options.offset_n,
            alike,
            one_clock: true,
        }
    }
}

/// A law with its values.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::identify) struct Estimate {
    /// The law.
    pub(crate) law: PathLaw,
    /// Mass, kg.
    pub(crate) mass_kg: f64,
    /// Viscous friction for positive and negative motion, N s/m.
    pub(crate) viscous: [f64; 2],
    /// Constant force, N.
    pub(crate) offset_n: f64,
    /// How much the force's clock is ahead of the position's, s.
    pub(crate) shift_s: f64,
    /// The law's values, at the places of [`PathLaw`].
    pub(crate) values: Vec<f64>,
}

impl Estimate {
    /// The law with the values that were found; `None` where they are not those of such a law. A refused Stribeck curve
    /// or damping is left out.
    pub(in crate::identify) fn of(found: &Identified) -> Option<Self> {
        let (dynamic, stiffness) = (found.dynamic_force_n?, found.stiffness_n_per_m?);
        let viscous = found.viscous_ns_per_m.unwrap_or_default();
        let fixed = found.static_force_n.unwrap_or(dynamic);
        let ratios = [fixed.positive / dynamic.positive, fixed.negative / dynamic.negative];
        let fall = found.stribeck_velocity_mps;
        let (law, rest) = match found.model {
            ModelKind::Dahl => (PathLaw::Dahl, vec![found.exponent.unwrap_or(1.0)]),
            ModelKind::Lugre => {
                let [positive, negative] = if fall.is_some() { ratios } else { [1.0; 2] };
                let damping = found.bristle_damping_ns_per_m.unwrap_or(0.0);
                (PathLaw::Lugre, vec![positive, negative, fall.unwrap_or(1.0), damping])
            }
            ModelKind::Karnopp | ModelKind::Auto => return None,
        };
        Some(Self {
            law,
            mass_kg: found.mass_kg.unwrap_or(0.0),
            viscous: [viscous.positive, viscous.negative],
            offset_n: found.offset_n.unwrap_or(0.0),
            shift_s: 0.0,
            values: [&[dynamic.positive, dynamic.negative, 0.0, stiffness], rest.as_slice()].concat(),
        })
    }

    /// The force that the law and the mass take at each sample, N, with an acceleration for each, m/s^2.
    pub(in crate::identify) fn force(&self, path: &Path, acceleration: &[f64]) -> Vec<f64> {
        let friction = self.law.along(&self.values, path).friction_n;
        (0..friction.len())
            .map(|k| {
                let speed = path.speed_mps[k];
                let viscous = self.viscous[usize::from(speed < 0.0)] * speed;
                self.mass_kg * acceleration[k] + friction[k] + viscous + self.offset_n
            })
            .collect()
    }
}

/// A parameter that is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Mass,
    Viscous(usize),
    Offset,
    Shift,
    /// A positive value: its logarithm, within limits.
    Logarithm {
        at: usize,
        least: f64,
        most: f64,
    },
    Value(usize),
}

/// The parameters that are fitted.
fn places(law: PathLaw, assumed: &Assumptions) -> Vec<Place> {
    let mut places = Vec::new();
    if assumed.mass_kg.is_none() {
        places.push(Place::Mass);
    }
    if assumed.offset_n.is_none() {
        places.push(Place::Offset);
    }
    if !assumed.one_clock {
        places.push(Place::Shift);
    }
    let positive = |at, least, most| Place::Logarithm { at, least, most };
    for side in 0..if assumed.alike { 1 } else { 2 } {
        places.push(Place::Viscous(side));
        places.push(positive(PathLaw::DYNAMIC + side, 1e-6, 1e5));
        if law == PathLaw::Lugre {
            // A limit of 0 or less is none.
            places.push(positive(PathLaw::STATIC_RATIO + side, 0.05, 20.0));
        }
    }
    if law != PathLaw::Coulomb {
        places.push(positive(PathLaw::STIFFNESS, 1.0, 1e10));
        places.push(Place::Value(PathLaw::START));
    }
    match law {
        PathLaw::Coulomb => (),
        PathLaw::Dahl => places.push(positive(PathLaw::EXPONENT, 0.02, 8.0)),
        PathLaw::Lugre => {
            places.push(positive(PathLaw::STRIBECK, 1e-5, 10.0));
            places.push(Place::Value(PathLaw::DAMPING));
        }
    }
    places
}

impl Place {
    fn of(self, estimate: &Estimate) -> f64 {
        match self {
            Self::Mass => estimate.mass_kg,
            Self::Viscous(side) => estimate.viscous[side],
            Self::Offset => estimate.offset_n,
            Self::Shift => estimate.shift_s,
            Self::Logarithm { at, .. } => estimate.values[at].ln(),
            Self::Value(at) => estimate.values[at],
        }
    }

    fn set_value(self, value: f64, alike: bool, estimate: &mut Estimate) {
        let mut set_at = |at: usize, value: f64| {
            estimate.values[at] = value;
            if alike && estimate.law.is_by_direction(at) {
                estimate.values[at + 1] = value;
            }
        };
        match self {
            Self::Mass => estimate.mass_kg = value,
            Self::Offset => estimate.offset_n = value,
            Self::Shift => estimate.shift_s = value,
            Self::Viscous(_) if alike => estimate.viscous = [value; 2],
            Self::Viscous(side) => estimate.viscous[side] = value,
            Self::Logarithm { at, least, most } => set_at(at, value.exp().clamp(least, most)),
            Self::Value(at) => set_at(at, value),
        }
    }
}

/// What the fit found.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// The best values.
    pub(crate) estimate: Estimate,
    /// What each row leaves, N.
    pub(crate) residual: Vec<f64>,
    /// Root mean square of the rows that were fitted, N.
    pub(crate) rms_n: f64,
    /// The same with their weights.
    pub(crate) weighted_rms: f64,
}

struct Problem<'a> {
    path: &'a Path,
    rows: &'a Rows,
    kept: &'a [usize],
    places: &'a [Place],
    alike: bool,
    estimate: Estimate,
    /// The law's friction along the path.
    course: Course,
    /// The same under each row, N.
    friction: Vec<f64>,
}

impl Problem<'_> {
    fn set(&mut self, values: &DVector<f64>) {
        let before = self.estimate.values.clone();
        for (place, value) in self.places.iter().zip(values.iter()) {
            place.set_value(*value, self.alike, &mut self.estimate);
        }
        if self.friction.is_empty() || before != self.estimate.values {
            self.course = self.estimate.law.along(&self.estimate.values, self.path);
            self.friction = self.rows.functions.of_force(&self.course.friction_n);
        }
    }

    /// What a row leaves, N.
    fn left(&self, row: usize) -> f64 {
        let Estimate {
            mass_kg,
            viscous,
            offset_n,
            shift_s,
            ..
        } = &self.estimate;
        let rubbed = viscous[0] * self.rows.velocity[0][row] + viscous[1] * self.rows.velocity[1][row];
        self.rows.force[row] + shift_s * self.rows.rate[row]
            - mass_kg * self.rows.acceleration[row]
            - rubbed
            - offset_n
            - self.friction[row]
    }

    /// Minus the derivative of what is left of the kept rows, by a parameter.
    fn regressors(&self, place: Place) -> Vec<f64> {
        let of_rows = |of: &dyn Fn(usize) -> f64| self.kept.iter().map(|&row| of(row)).collect();
        let rows = self.rows;
        match place {
            Place::Mass => of_rows(&|row| rows.acceleration[row]),
            Place::Offset => vec![1.0; self.kept.len()],
            Place::Shift => of_rows(&|row| -rows.rate[row]),
            Place::Viscous(_) if self.alike => of_rows(&|row| rows.velocity[0][row] + rows.velocity[1][row]),
            Place::Viscous(side) => of_rows(&|row| rows.velocity[side][row]),
            Place::Value(at) => self.by_value(at, 1.0),
            Place::Logarithm { at, most, .. } => {
                let value = self.estimate.values[at];
                self.by_value(at, if value < most { value } else { 0.0 })
            }
        }
    }

    /// The derivative of the kept rows' friction by one of the law's values, or by both where directions are alike.
    fn by_value(&self, at: usize, scale: f64) -> Vec<f64> {
        let has_two = self.alike && self.estimate.law.is_by_direction(at);
        let columns = &self.course.by_value[at..=at + usize::from(has_two)];
        let under: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| self.rows.functions.of_force(column))
            .collect();
        let sum = |&row: &usize| scale * under.iter().map(|column| column[row]).sum::<f64>();
        self.kept.iter().map(sum).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, values: &DVector<f64>) {
        self.set(values);
    }

    fn params(&self) -> DVector<f64> {
        DVector::from_iterator(
            self.places.len(),
            self.places.iter().map(|place| place.of(&self.estimate)),
        )
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut left = DVector::from_iterator(self.kept.len(), self.kept.iter().map(|&row| self.left(row)));
        self.rows.errors.whiten(self.kept, left.as_mut_slice());
        left.iter().all(|left| left.is_finite()).then_some(left)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.kept.len(), self.places.len());
        for (&place, mut column) in self.places.iter().zip(jacobian.column_iter_mut()) {
            for (entry, regressor) in column.iter_mut().zip(self.regressors(place)) {
                *entry = -regressor;
            }
            self.rows.errors.whiten(self.kept, column.as_mut_slice());
        }
        Some(jacobian)
    }
}

/// The best fit from a start, to the rows that are kept; `None` where there is none.
pub(crate) fn fit(
    path: &Path,
    rows: &Rows,
    kept: &[usize],
    assumed: &Assumptions,
    start: &Estimate,
    tolerance: f64,
) -> Option<Fit> {
    let places = places(start.law, assumed);
    if kept.len() < 4 * places.len() {
        return None;
    }
    let mut estimate = start.clone();
    estimate.mass_kg = assumed.mass_kg.unwrap_or(estimate.mass_kg);
    estimate.offset_n = assumed.offset_n.unwrap_or(estimate.offset_n);
    let mut problem = Problem {
        path,
        rows,
        kept,
        places: &places,
        alike: assumed.alike,
        estimate,
        course: Course::default(),
        friction: Vec::new(),
    };
    let values = problem.params();
    problem.set(&values);
    let (problem, _) = LevenbergMarquardt::new()
        .with_ftol(tolerance)
        .with_xtol(tolerance)
        .with_gtol(tolerance)
        .with_stepbound(1.0)
        .with_patience(20)
        .minimize(problem);
    let left = problem.residuals()?;
    let residual: Vec<f64> = (0..rows.len()).map(|row| problem.left(row)).collect();
    let freedom = (kept.len() - places.len()) as f64;
    Some(Fit {
        rms_n: (kept.iter().map(|&row| residual[row] * residual[row]).sum::<f64>() / freedom).sqrt(),
        weighted_rms: (left.norm_squared() / freedom).sqrt(),
        residual,
        estimate: problem.estimate,
    })
}
