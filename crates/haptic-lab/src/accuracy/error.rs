//! How far a run is from the true motion.

use crate::simulate::Simulation;

/// Worst differences between a run and the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunError {
    /// Block position, m.
    pub position_m: f64,
    /// Coupling force, N.
    pub force_n: f64,
    /// The same over `max(K |p|, 1 N)`, the size of the numbers that the force is the difference
    /// of.
    pub relative_force: f64,
    /// Time of a change of contact, s; `None` where the lists of changes differ.
    pub event_time_s: Option<f64>,
}

/// The greater of two errors. A run that blew up is infinitely far off: NaN must not pass for small.
pub(super) fn worse(so_far: f64, new: f64) -> f64 {
    if new.is_nan() { f64::INFINITY } else { so_far.max(new) }
}

/// Compares a run with the truth, row by row and change by change. `stiffness` is the coupling's,
/// N/m.
#[must_use]
pub fn compare(run: &Simulation, truth: &Simulation, stiffness: f64) -> RunError {
    let mut error = RunError::default();
    for (row, truth) in run.rows.iter().zip(&truth.rows) {
        let force = (row.coupling_force_n - truth.coupling_force_n).abs();
        error.position_m = worse(error.position_m, (row.block_position_m - truth.block_position_m).abs());
        error.force_n = worse(error.force_n, force);
        let scale = (stiffness * row.device.position_m.abs()).max(1.0);
        error.relative_force = worse(error.relative_force, force / scale);
    }
    let same_changes = run.events.len() == truth.events.len()
        && run
            .events
            .iter()
            .zip(&truth.events)
            .all(|(a, b)| (a.from, a.to) == (b.from, b.to));
    if same_changes {
        let times = run.events.iter().zip(&truth.events).map(|(a, b)| (a.t_s - b.t_s).abs());
        error.event_time_s = Some(times.fold(0.0, worse));
    }
    error
}
