//! Viscous friction: `F = b w`, and nothing that holds.

use super::{Directional, Slot};
use crate::parameters::Parameter;

/// Drag in proportion to velocity. 35 N s/m is the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Viscous {
    /// `b`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2"))]
    pub viscous: Directional,
}

impl Viscous {
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        (parameter == Parameter::Viscous).then_some(Slot::Two(&mut self.viscous))
    }
}
