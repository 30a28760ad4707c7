//! The block and its coupling, as a scene describes them.

use super::state::BlockState;

/// The block that the hand drags.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Block {
    /// `M`, kg.
    #[cfg_attr(feature = "serde", serde(alias = "M"))]
    pub mass: f64,
}

/// The virtual coupling between device and block (Colgate, Stanley and Brown 1995).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Coupling {
    /// `K`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "K"))]
    pub stiffness: f64,
    /// `B`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "B"))]
    pub damping: f64,
}

/// Up to this delay [`Coupling::CALM`] will do for a rig of 0.1 kg, s.
const CALM_UP_TO_S: f64 = 6e-3;

/// Delay at which it does with a factor to spare, s.
const CALM_WITH_ROOM_S: f64 = 4e-3;

/// Below that a grip is no longer felt, N/m.
const SOFTEST_N_PER_M: f64 = 20.0;

impl Coupling {
    /// One that light rigs and those behind a USB link can bear.
    pub const CALM: Self = Self {
        stiffness: 1000.0,
        damping: 10.0,
    };

    /// One for a light rig that gets the force for a sample so late, s, that [`Coupling::CALM`] would oscillate; `None`
    /// where that will do, or none would be felt. A mass on a spring and a damper that act late is similar to itself
    /// where `K` falls with the square of the delay and `B` with the delay.
    #[must_use]
    pub fn calm_behind(delay_s: f64) -> Option<Self> {
        let slower = delay_s / CALM_WITH_ROOM_S;
        let softer = Self {
            stiffness: Self::CALM.stiffness / (slower * slower),
            damping: Self::CALM.damping / slower,
        };
        (delay_s > CALM_UP_TO_S && softer.stiffness >= SOFTEST_N_PER_M).then_some(softer)
    }

    /// The force on a block, N: `K (p - x) + B (v - w)`.
    #[must_use]
    pub fn force(&self, state: &BlockState) -> f64 {
        self.stiffness * state.deflection() + self.damping * (state.device_velocity - state.velocity)
    }
}

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
