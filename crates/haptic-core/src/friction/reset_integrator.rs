//! The reset integrator (Haessig and Friedland 1991, "On the modeling and simulation of friction"):
//! a bristle that is deflected up to its length `z0`, and then slides at that deflection.
//!
//! ```text
//! z' = 0 where |z| >= z0 and the motion is outward, else v
//! F  = (1 + a) sigma z + beta z' while it holds,  sigma z while it slides
//! ```
//!
//! Its parameters here are the forces that it gives: `Fd = sigma z0` and `Fs = (1 + a) sigma z0`.
//! As published, the force jumps from `Fd` back to `Fs` when a slide ends, which creates energy;
//! `reseat = "continuous"`, the default, keeps the force instead, and `reseat = "slides"` (or
//! `"published"`) is the model as it was printed.

use super::forces::{check_static_not_below, check_stiction, limit_stiction, raise};
use super::law::{self, Law, LawKind};
use crate::contact::{ConstantLimit, Reseat, SpringContact, SpringState};
use crate::directional::{Direction, Directional};
use crate::parameters::{Parameter, SceneError, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use alloc::boxed::Box;

/// The reset integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ResetIntegrator {
    /// `Fs = (1 + a) sigma z0`, N: what it holds; not below `Fd`, and at most [`MAX_STICTION`](super::MAX_STICTION)
    /// times it.
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

impl ResetIntegrator {
    /// `(1 + a) sigma`, N/m, by the direction that the bristle is loaded in.
    fn stuck_stiffness(&self) -> Directional {
        self.static_force.zip(self.dynamic_force, |held, sliding| {
            let gain = if sliding > 0.0 { held / sliding } else { 1.0 };
            gain * self.contact_stiffness
        })
    }

    fn contact(&self) -> SpringContact<Directional, ConstantLimit> {
        SpringContact {
            stiffness: self.stuck_stiffness(),
            damping: self.contact_damping,
            static_force: self.static_force,
            static_limit: ConstantLimit,
            level: self.dynamic_force,
            viscous: self.viscous,
            velocity_threshold: 0.0,
            reseat: self.reseat,
            state: SpringState::AT_REST,
        }
    }
}

impl LawKind for ResetIntegrator {
    const NAME: &'static str = "reset-integrator";
    const SUMMARY: &'static str =
        "A spring and damper up to a length, then a slide at that deflection (Haessig and Friedland 1991)";

    fn defaults() -> Self {
        Self {
            static_force: Directional::both(law::STATIC_FORCE),
            dynamic_force: Directional::both(law::DYNAMIC_FORCE),
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            contact_damping: law::CONTACT_DAMPING,
            viscous: Directional::both(0.0),
            reseat: Reseat::Continuous,
        }
    }
}

impl Law for ResetIntegrator {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ContactDamping => Some(Slot::One(&mut self.contact_damping)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    fn validate(&self, _on_device: bool) -> Result<(), SceneError> {
        check_static_not_below(Self::NAME, self.static_force, self.dynamic_force)?;
        check_stiction(Self::NAME, self.static_force, self.dynamic_force)
    }

    fn comply(&mut self) {
        raise(&mut self.static_force, self.dynamic_force);
        limit_stiction(&mut self.static_force, self.dynamic_force);
    }

    fn holding_force(&self) -> Directional {
        self.static_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.dynamic_force.get(direction) + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.stuck_stiffness().greatest()
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        self.yielding(block, self.contact())
    }

    fn on_device(&self) -> Box<dyn Surface> {
        Box::new(DeviceSurface::new(self.contact()))
    }
}
