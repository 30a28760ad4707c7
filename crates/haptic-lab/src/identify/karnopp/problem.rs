//! A record on its way through the fit: its motion, and the force on the same clock.

use super::clocks;
use super::motion::Motion;
use super::regression::{Fit, Rows, Shape, fit};
use crate::identify::grid::Grid;
use crate::median::median;
use crate::robust_fit::Unfit;
use crate::smoothing::white_noise;
use nalgebra::DVector;

/// A change from one sample to the next is a step beyond so many deviations of its noise, and this share of the forces' span.
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
}

impl Problem<'_> {
    pub(super) fn fit(&self, rows: &Rows, shape: Shape) -> Result<Fit, Unfit> {
        let forces = clocks::without_inertia(rows, rows.forces(&self.force), self.known_mass);
        if shape.hats == 0 {
            return fit(rows, &forces, &[], shape);
        }
        fit(&rows.clone().with_places(self.grid, shape.hats), &forces, &[], shape)
    }

    /// How the unknowns would change with a shift of the force, each a second, where the force steps so often within
    /// slides that it matters when between two samples it does: what is left of that is half a period to either side, less
    /// where the steps fall at other phases each time.
    pub(super) fn change_with_steps(&self, rows: &Rows, shape: Shape) -> Option<DVector<f64>> {
        let share = self.share_of_steps()?;
        if shape.hats > 0 {
            return None;
        }
        let rates = rows.force_rates(&self.force);
        let change = fit(rows, &rates, &[], shape).ok()?.found.values;
        Some(change * (share * self.grid.period_s / 12.0_f64.sqrt()))
    }

    /// Of the time of a step within its period, the share that does not cancel over the record; `None` where the force
    /// hardly steps.
    fn share_of_steps(&self) -> Option<f64> {
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
        let mut off: Vec<f64> = apart.iter().map(|apart| (apart - middle).abs()).collect();
        let deviation = 1.4826 * median(&mut off).unwrap_or(0.0);
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
