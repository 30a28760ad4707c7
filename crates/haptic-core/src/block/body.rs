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

impl Coupling {
    /// One that light rigs and those behind a USB link can bear.
    pub const CALM: Self = Self {
        stiffness: 1000.0,
        damping: 10.0,
    };

    /// The force on a block, N: `K (p - x) + B (v - w)`.
    #[must_use]
    pub fn force(&self, state: &BlockState) -> f64 {
        self.stiffness * state.deflection() + self.damping * (state.device_velocity - state.velocity)
    }
}
