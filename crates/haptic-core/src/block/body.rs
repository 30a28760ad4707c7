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
