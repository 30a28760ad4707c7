//! A record on its way through the fit: its motion, and the force on the same clock.
//!
//! Beside it: which window the record is seen through, and the fit to the slides, with what the calibration and the
//! times of steps add to its errors.

use super::motion::MotionEstimate;
use super::regression::{Beside, Fit, Rows, Shape, Unknown, fit};
use crate::identify::grid::Grid;
use crate::identify::options::Options;
use crate::robust_fit::{NORMAL_95, Unfit, robust_deviation};
use crate::smoothing::white_noise;
use haptic_motion::median::{median, span_of_nine_tenths};
use nalgebra::DVector;

/// A change from one sample to the next is a step beyond so many deviations of its noise, and this share of the forces'
/// span.
const STEP_DEVIATIONS: f64 = 11.0;
const STEP_SHARE: f64 = 0.25;

/// Steps in each slide from which on their times matter.
const STEPS_A_SLIDE: f64 = 0.25;

/// A record on its way through the fit.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    pub(super) grid: &'a Grid,
    pub(super) motion: &'a MotionEstimate,
    /// Driving force on the positions' clock, N.
    pub(super) force: Vec<f64>,
    pub(super) known_mass: f64,
    /// How far windows stay clear of the ends of a slide, s.
    pub(super) margin_s: f64,
}

/// Where the shift of the clocks is looked for, s: how the force changes about a turn says when the mass set off, which
/// is not known, and would be taken for a shift.
const MARGIN_WITH_SHIFT_S: f64 = 0.01;

impl<'a> Problem<'a> {
    pub(super) fn new(grid: &'a Grid, motion: &'a MotionEstimate, options: &Options) -> Self {
        let is_of_two_clocks = options.clocks.longest_shift_s() > 0.0;
        Self {
            force: grid.force_n.clone(),
            grid,
            motion,
            known_mass: options.mass_kg.unwrap_or(0.0),
            margin_s: if is_of_two_clocks { MARGIN_WITH_SHIFT_S } else { 0.0 },
        }
    }

    /// The same with another force.
    pub(super) fn with_force(&self, force: Vec<f64>) -> Self {
        Self { force, ..*self }
    }

    /// The rows under a window.
    pub(super) fn rows(&self, half_s: f64) -> Rows {
        Rows::new(self.grid, self.motion, half_s, self.margin_s)
    }

    pub(super) fn fit(&self, rows: &Rows, shape: Shape) -> Result<Fit, Unfit> {
        let mut forces = rows.forces(&self.force);
        for (force, row) in forces.iter_mut().zip(&rows.rows) {
            *force -= self.known_mass * row.acceleration;
        }
        self.fit_to(rows, &forces, shape)
    }

    /// Fits the shape to other forces of the rows than those that were recorded.
    fn fit_to(&self, rows: &Rows, forces: &[f64], shape: Shape) -> Result<Fit, Unfit> {
        let places = match shape.hats {
            0 => Vec::new(),
            hats => rows.places(self.grid, hats),
        };
        let (rates, force_noise_n) = if shape.has_shift {
            (
                rows.force_rates(&self.force),
                white_noise(&self.force, &self.grid.is_valid),
            )
        } else {
            (Vec::new(), 0.0)
        };
        let beside = Beside {
            rates: &rates,
            force_noise_n,
            places: &places,
        };
        fit(rows, forces, beside, shape)
    }

    /// What a fit leaves, in multiples of what noise of the force and of the positions leaves.
    pub(super) fn excess(&self, rows: &Rows, fit: &Fit) -> f64 {
        let slope: f64 = rows.window.slope.iter().map(|weight| weight * weight).sum();
        let viscous = (0..2).filter_map(|side| fit.value(Unknown::Viscous(side)));
        let forces = rows.forces(&self.force);
        let square: f64 = forces.iter().map(|force| force * force).sum();
        let acceleration_noise = self.motion.acceleration_noise(&rows.window);
        let expected = self
            .force_noise(rows)
            .hypot(SAMPLING_SHARE * (square / forces.len().max(1) as f64).sqrt())
            .hypot(fit.value(Unknown::Mass).unwrap_or(self.known_mass) * acceleration_noise)
            .hypot(viscous.fold(0.0, f64::max) * self.motion.noise_m * slope.sqrt());
        fit.rms_n() / expected.max(f64::MIN_POSITIVE)
    }

    /// How the unknowns would change with a shift of the force, each a second, where the force steps so often within
    /// slides that it matters when between two samples it does: what is left of that is half a period to either side,
    /// less where the steps fall at other phases each time.
    pub(super) fn change_with_steps(&self, rows: &Rows, shape: Shape) -> Option<DVector<f64>> {
        let share = self.share_of_steps()?;
        let rates = rows.force_rates(&self.force);
        let change = self.fit_to(rows, &rates, shape).ok()?.found.values;
        Some(change * (share * self.grid.period_s / 12.0_f64.sqrt()))
    }

    /// Of the time of a step within its period, the share that does not cancel over the record; `None` where the force
    /// hardly steps.
    pub(super) fn share_of_steps(&self) -> Option<f64> {
        let force = &self.force;
        let span = span_of_nine_tenths(force);
        let least = (STEP_DEVIATIONS * white_noise(force, &self.grid.is_valid)).max(STEP_SHARE * span);
        let steps: Vec<usize> = (1..force.len())
            .filter(|&at| self.motion.sense[at] != 0 && (force[at] - force[at - 1]).abs() > least)
            .collect();
        let slides = self.motion.slides(1, 8) + self.motion.slides(-1, 8);
        if steps.len() as f64 <= STEPS_A_SLIDE * slides as f64 {
            return None;
        }
        let mut apart: Vec<f64> = steps.windows(3).map(|three| (three[2] - three[0]) as f64).collect();
        let middle = median(&mut apart).unwrap_or(0.0);
        apart.iter_mut().for_each(|apart| *apart -= middle);
        let deviation = robust_deviation(&apart);
        Some((2.0 / deviation.max(f64::MIN_POSITIVE)).min(1.0).powi(2))
    }

    /// What the force's white noise leaves of a row's force, N.
    pub(super) fn force_noise(&self, rows: &Rows) -> f64 {
        let mean_noise = rows
            .window
            .mean
            .iter()
            .map(|weight| weight * weight)
            .sum::<f64>()
            .sqrt();
        white_noise(&self.force, &self.grid.is_valid) * mean_noise
    }
}

/// Half-lengths of windows, s: from the slides of a quick stick-slip to those of a slow rig.
const MIN_HALF_S: f64 = 6e-3;
const MAX_HALF_S: f64 = 0.12;

/// Ratio of neighbouring half-lengths.
const RATIO: f64 = 1.35;

/// Fewest samples on either side: with fewer the windows for position and force are no longer alike.
const MIN_REACH: f64 = 6.0;

/// How much wider the intervals may be than under the best window, on the geometric mean.
const MAX_LOSS: f64 = 1.2;
/// The same where the shift of two clocks is fitted: what a short window lets in determines it as well.
const MAX_LOSS_WITH_SHIFT: f64 = 2.5;

/// The half-lengths that are tried, s.
pub(super) fn window_candidates(period_s: f64) -> Vec<f64> {
    let shortest = MIN_HALF_S.max(MIN_REACH * period_s);
    let longest = MAX_HALF_S.max(2.0 * shortest);
    std::iter::successors(Some(shortest), |half_s| Some(half_s * RATIO))
        .take_while(|half_s| *half_s <= longest)
        .collect()
}

/// The longest window whose intervals are hardly wider than the narrowest. A short one lets in the
/// encoder's noise and what a rigid mass does not explain; a long one has no place between two rests.
pub(super) fn choose_window(problem: &Problem<'_>, shape: Shape) -> Result<Rows, Unfit> {
    let mut unfit = Unfit::TooFewRows(0);
    let mut fits = Vec::new();
    for half_s in window_candidates(problem.grid.period_s) {
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

/// No calibration is better than this share of a value, however narrow the fit's own interval.
pub(in crate::identify) const CALIBRATION_SHARE: f64 = 1e-3;

/// The same for a mass. A grip of stiffness `K` bends the force between two samples, so that its mean differs from the
/// samples by `K T^2 / 12` times the acceleration: 1.7 g at 20 kN/m and 1 kHz.
pub(in crate::identify) const SAMPLING_SHARE: f64 = 3e-3;

/// No force is in proportion by more than this share of itself: how it goes with velocity is not known better, also
/// where a record is computed and has no noise.
const LINEARITY_SHARE: f64 = 1e-4;

/// A fit under its window.
#[derive(Debug)]
pub(super) struct Slides {
    pub(super) rows: Rows,
    pub(super) fit: Fit,
    /// What is not known of the times of the force's steps, in each unknown.
    steps: Option<DVector<f64>>,
    /// By how much another fit differs, in each unknown.
    other: Option<DVector<f64>>,
}

impl Slides {
    pub(super) fn new(problem: &Problem<'_>, rows: Rows, shape: Shape) -> Result<Self, Unfit> {
        let fit = problem.fit(&rows, shape)?;
        Ok(Self::of(problem, rows, fit))
    }

    pub(super) fn of(problem: &Problem<'_>, rows: Rows, fit: Fit) -> Self {
        Self {
            steps: problem.change_with_steps(&rows, fit.shape),
            other: None,
            rows,
            fit,
        }
    }

    /// Mass, viscous and dynamic friction, as far as they are in the fit.
    pub(super) fn unknowns(&self) -> impl Iterator<Item = Unknown> {
        let levels = if self.fit.shape.is_separate { 2 } else { 1 };
        let (mass, viscous) = ([Unknown::Mass], [0, 1].map(Unknown::Viscous));
        let all = mass.into_iter().chain(viscous).chain((0..levels).map(Unknown::Level));
        let there = self.fit.shape.unknowns();
        all.filter(move |unknown| there.contains(unknown))
    }

    /// Adds to the half of intervals.
    pub(super) fn widen(&mut self, by: Vec<(Unknown, f64)>) {
        let mut other = DVector::zeros(self.fit.found.values.len());
        for (unknown, by) in by {
            if let Some(place) = self.fit.place(unknown) {
                other[place] = by;
            }
        }
        self.other = Some(other);
    }

    /// Viscous friction, N s/m, of which the fastest slide shows no more than [`LINEARITY_SHARE`] of the force.
    fn least_viscous(&self) -> f64 {
        let rows = &self.rows.rows;
        let fastest = rows
            .iter()
            .fold(0.0, |fastest: f64, row| fastest.max(row.velocity.abs()));
        if fastest > 0.0 {
            self.least_force_n() / fastest
        } else {
            0.0
        }
    }

    /// The least force that is told from none, N: [`LINEARITY_SHARE`] of the kinetic friction.
    pub(super) fn least_force_n(&self) -> f64 {
        LINEARITY_SHARE * self.fit.value(Unknown::Level(0)).unwrap_or(0.0).abs()
    }

    /// A sum of unknowns with factors, and half of its 95 % interval.
    pub(super) fn value(&self, sum: &[(Unknown, f64)]) -> Option<(f64, f64)> {
        let of = |fit: &Fit| {
            sum.iter()
                .map(|(unknown, factor)| fit.value(*unknown).map(|value| factor * value))
                .sum::<Option<f64>>()
        };
        let value = of(&self.fit)?;
        let statistical = self.fit.uncertainty(sum)?.reach_95();
        let factors = self.fit.factors(sum)?;
        let steps = self.steps.as_ref().map_or(0.0, |steps| NORMAL_95 * factors.dot(steps));
        let other = self.other.as_ref().map_or(0.0, |other| factors.abs().dot(other));
        let floor = match sum {
            [(Unknown::Mass, _)] => SAMPLING_SHARE * value,
            [(Unknown::Viscous(_), _)] => (CALIBRATION_SHARE * value).hypot(self.least_viscous()),
            _ => CALIBRATION_SHARE * value,
        };
        Some((
            value,
            statistical.hypot(steps).hypot(floor) + other + self.fit.bias(sum),
        ))
    }
}
