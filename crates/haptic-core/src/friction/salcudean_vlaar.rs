//! Salcudean and Vlaar's stick-slip (Salcudean and Vlaar 1994, "On the emulation of stiff walls and static friction with a magnetically levitated input/output device"):
//! a spring that holds up to the static limit, and only drag while it slides.
//!
//! ```text
//! stuck:    F = Kp (x - xs),  until |F| > Fs
//! sliding:  F = b v,          until |v| < DV; the spring is then anchored where the force stays as it was
//! ```

use super::spring_contact::{SpringContact, SpringState};
use super::static_limit::AtOnce;
use super::{Directional, Reseat, Slot};
use crate::parameters::Parameter;

/// Salcudean-Vlaar friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SalcudeanVlaar {
    /// `Fs`, N: what the spring holds.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Kp`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `b`, N s/m: drag while it slides.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
    /// `DV`, m/s: a slide that falls below it ends.
    #[cfg_attr(feature = "serde", serde(alias = "DV", default))]
    pub velocity_threshold: f64,
}

impl SalcudeanVlaar {
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            Parameter::VelocityThreshold => Some(Slot::One(&mut self.velocity_threshold)),
            _ => None,
        }
    }

    pub(crate) fn contact(&self) -> SpringContact<Directional, AtOnce> {
        SpringContact {
            stiffness: Directional::both(self.contact_stiffness),
            damping: 0.0,
            static_force: self.static_force,
            static_limit: AtOnce,
            level: Directional::both(0.0),
            viscous: self.viscous,
            velocity_threshold: self.velocity_threshold,
            reseat: Reseat::Continuous,
            state: SpringState::AT_REST,
        }
    }
}
