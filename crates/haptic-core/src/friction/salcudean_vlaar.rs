//! Salcudean and Vlaar's stick-slip (Salcudean and Vlaar 1994, "On the emulation of stiff walls and
//! static friction with a magnetically levitated input/output device"): a spring that holds up to
//! the static limit, and only drag while it slides.
//!
//! ```text
//! stuck:    F = Kp (x - xs),  until |F| > Fs
//! sliding:  F = b v,          until |v| < DV; the spring is then anchored where the force stays as it was
//! ```
//!
//! With `DV` a stop creates energy of `(b DV)^2/2 Kp`, as the spring did not store the force that it then holds.

use super::law::{self, Law, LawKind};
use crate::contact::{ConstantLimit, Reseat, SpringContact, SpringState};
use crate::directional::{Direction, Directional};
use crate::parameters::{Note, NoteKind, Parameter, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use alloc::boxed::Box;
use alloc::vec::Vec;

/// Salcudean-Vlaar friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    fn contact(&self) -> SpringContact<Directional, ConstantLimit> {
        SpringContact {
            stiffness: Directional::both(self.contact_stiffness),
            damping: 0.0,
            static_force: self.static_force,
            static_limit: ConstantLimit,
            level: Directional::both(0.0),
            viscous: self.viscous,
            velocity_threshold: self.velocity_threshold,
            reseat: Reseat::Continuous,
            state: SpringState::AT_REST,
        }
    }
}

impl LawKind for SalcudeanVlaar {
    const NAME: &'static str = "salcudean-vlaar";
    const SUMMARY: &'static str =
        "A spring that holds up to the static force, and only drag while it slides (Salcudean and Vlaar 1994)";

    fn defaults() -> Self {
        Self {
            static_force: Directional::both(law::STATIC_FORCE),
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            viscous: Directional::both(0.0),
            velocity_threshold: 0.0,
        }
    }
}

impl Law for SalcudeanVlaar {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            Parameter::VelocityThreshold => Some(Slot::One(&mut self.velocity_threshold)),
            _ => None,
        }
    }

    fn notes(&self) -> Vec<Note> {
        let held = self
            .viscous
            .zip(self.static_force, |viscous, most| {
                (viscous * self.velocity_threshold).min(most)
            })
            .greatest();
        let kind = NoteKind::StopCreatesEnergy {
            velocity_threshold: self.velocity_threshold,
            energy: 0.5 * held * held / self.contact_stiffness,
        };
        let note = Note {
            param: Parameter::VelocityThreshold.into(),
            kind,
        };
        (held > 0.0).then_some(note).into_iter().collect()
    }

    fn holding_force(&self) -> Directional {
        self.static_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.contact_stiffness
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        self.yielding(block, self.contact())
    }

    fn on_device(&self) -> Box<dyn Surface> {
        Box::new(DeviceSurface::new(self.contact()))
    }
}
