//! The pull of the device between two samples.

use super::body::Coupling;
use super::state::BlockState;

/// `K p + B v` between two samples, less `K` times the block's position at the start of the tick:
/// the coupling force if the block stood still there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    /// At the start of the tick, N.
    pub(super) at_start: f64,
    /// N/s.
    pub(super) slope: f64,
}

impl Load {
    /// From the last sample, which `state` holds, to one of `position` (m) and `velocity` (m/s),
    /// `elapsed_s` later.
    pub(super) fn new(coupling: &Coupling, state: &BlockState, elapsed_s: f64, position: f64, velocity: f64) -> Self {
        let Coupling { stiffness, damping } = *coupling;
        // Differences, not K p: at a large offset the products would drown the deflection.
        Self {
            at_start: stiffness * state.deflection() + damping * state.device_velocity,
            slope: (stiffness * (position - state.device_position) + damping * (velocity - state.device_velocity))
                / elapsed_s,
        }
    }

    pub(super) fn at(&self, time: f64) -> f64 {
        self.at_start + self.slope * time
    }
}

/// Within this, N, a force on the block equals another: the rounding of `K p + B v` at the start of
/// a tick.
pub(super) fn rounding(coupling: &Coupling, state: &BlockState) -> f64 {
    f64::EPSILON
        * (2.0 * coupling.stiffness * state.position.abs() + 4.0 * (coupling.damping * state.device_velocity).abs())
}
