//! A record on its way through the fit: its motion, and the force on the same clock.

use super::clocks;
use super::motion::Motion;
use super::regression::{Fit, Rows, Shape, fit};
use crate::identify::grid::Grid;
use crate::robust_fit::Unfit;
use crate::smoothing::white_noise;

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
        fit(rows, &forces, &[], shape)
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
