//! The reset integrator (Haessig and Friedland 1991, "On the modeling and simulation of friction"): a bristle that is deflected up to its length `z0`, and then slides at
//! that deflection.
//!
//! ```text
//! z' = 0 where |z| >= z0 and the motion is outward, else v
//! F  = (1 + a) sigma z + beta z' while it holds,  sigma z while it slides
//! ```
//!
//! Its parameters here are the forces that it gives: `Fd = sigma z0` and `Fs = (1 + a) sigma z0`. As published, the force jumps from `Fd` back to `Fs` when a slide ends, which
//! creates energy; `reseat = "continuous"`, the default, keeps the force instead, and `reseat = "slides"` (or `"published"`) is the model as it was printed.

use super::spring_contact::{SpringContact, SpringState};
use super::static_limit::AtOnce;
use super::{Directional, Reseat, Slot};
use crate::parameters::Parameter;

/// The reset integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ResetIntegrator {
    /// `Fs = (1 + a) sigma z0`, N: what it holds; not below `Fd`, and at most [`MOST_STICTION`] times it.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Fd = sigma z0`, N: the force of a slide.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `sigma`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `beta`, N s/m: damping while it holds.
    #[cfg_attr(feature = "serde", serde(alias = "sigma1", alias = "beta", default))]
    pub contact_damping: f64,
    /// `b`, N s/m: viscous friction while it slides.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
    /// What it holds on to when a slide ends.
    #[cfg_attr(feature = "serde", serde(default))]
    pub reseat: Reseat,
}

/// Largest `Fs/Fd = 1 + a`: the bristle's stiffness grows with it.
pub const MOST_STICTION: f64 = 100.0;

impl ResetIntegrator {
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ContactDamping => Some(Slot::One(&mut self.contact_damping)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    /// `(1 + a) sigma`, N/m, by the direction that the bristle is loaded in.
    pub(crate) fn stuck_stiffness(&self) -> Directional {
        self.static_force.zip(self.dynamic_force, |held, sliding| {
            let gain = if sliding > 0.0 { held / sliding } else { 1.0 };
            gain * self.contact_stiffness
        })
    }

    pub(crate) fn contact(&self) -> SpringContact<Directional, AtOnce> {
        SpringContact {
            stiffness: self.stuck_stiffness(),
            damping: self.contact_damping,
            static_force: self.static_force,
            static_limit: AtOnce,
            level: self.dynamic_force,
            viscous: self.viscous,
            velocity_threshold: 0.0,
            reseat: self.reseat,
            state: SpringState::AT_REST,
        }
    }
}
