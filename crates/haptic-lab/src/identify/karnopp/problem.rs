//! A record on its way through the fit: its motion, and the force on the same clock.

use super::motion::Motion;
use super::regression::{Beside, Fit, Rows, Shape, Unknown, fit};
use super::slides::SAMPLING_SHARE;
use crate::identify::grid::Grid;
use crate::identify::options::Options;
use crate::robust_fit::{Unfit, robust_deviation};
use crate::smoothing::white_noise;
use haptic_motion::median::median;
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
    pub(super) motion: &'a Motion,
    /// Driving force on the positions' clock, N.
    pub(super) force: Vec<f64>,
    pub(super) known_mass: f64,
    /// How far windows stay clear of the ends of a slide, s.
    pub(super) margin_s: f64,
}

/// Where the shift of the clocks is looked for, s: how the force changes about a turn says when the mass set off, which is
/// not known, and would be taken for a shift.
const MARGIN_WITH_SHIFT_S: f64 = 0.01;

impl<'a> Problem<'a> {
    pub(super) fn new(grid: &'a Grid, motion: &'a Motion, options: &Options) -> Self {
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
    /// slides that it matters when between two samples it does: what is left of that is half a period to either side, less
    /// where the steps fall at other phases each time.
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
        let mut sorted = force.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let span = sorted[sorted.len() * 19 / 20] - sorted[sorted.len() / 20];
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
