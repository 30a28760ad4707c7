//! The force of a fit, sample by sample, to be drawn beside the record.

use super::motion::Motion;
use crate::identify::grid::Grid;
use crate::identify::options::Record;
use crate::identify::result::Identified;
use crate::smoothing::{Window, weighted};

/// Half-length of the window under which accelerations are drawn, s; of at least six samples.
const HALF_S: f64 = 15e-3;

/// The record on an even grid and on one clock, and the force of the fit at each of its samples, N; NaN at rest and at
/// the ends, where sliding friction says nothing.
#[must_use]
pub(crate) fn fitted(record: &Record, found: &Identified) -> (Record, Vec<f64>) {
    let grid = Grid::new(record);
    let motion = Motion::new(&grid, record.resolution_m);
    let window = Window::new(HALF_S.max(6.0 * grid.period_s), grid.period_s);
    let (Some(dynamic), Some(viscous)) = (found.dynamic_force_n, found.viscous_ns_per_m) else {
        let nothing = vec![f64::NAN; grid.len()];
        return (even(&grid, found), nothing);
    };
    let (mass, offset) = (found.mass_kg.unwrap_or(0.0), found.offset_n.unwrap_or(0.0));
    let x = &grid.position_m;
    let force = (0..grid.len()).map(|at| {
        if motion.sense[at] == 0 || at < window.reach || at + window.reach >= grid.len() {
            return f64::NAN;
        }
        let v = motion.velocity_mps[at];
        let friction = if motion.sense[at] > 0 {
            dynamic.positive + viscous.positive * v
        } else {
            viscous.negative * v - dynamic.negative
        };
        mass * weighted(&window.curvature, x, at, x[at]) + friction + offset
    });
    let force = force.collect();
    (even(&grid, found), force)
}

fn even(grid: &Grid, found: &Identified) -> Record {
    Record {
        t_s: (0..grid.len())
            .map(|index| grid.start_s + index as f64 * grid.period_s)
            .collect(),
        position_m: grid.position_m.clone(),
        velocity_mps: None,
        force_n: grid.force_shifted(found.shift_s, 0.0),
        resolution_m: None,
    }
}
