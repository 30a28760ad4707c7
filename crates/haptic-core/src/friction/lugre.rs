//! LuGre friction (Canudas de Wit, Olsson, Astrom and Lischinsky 1995, "A new model for control of systems with friction").
//!
//! ```text
//! z' = v - sigma0 |v| z/g(v),   F = sigma0 z + sigma1 z' + b v,   g(v) = Fd + (Fs - Fd) e^-(v/ws)^2
//! ```
//!
//! Within a sample the bristle is moved on exactly for the mean speed, `z+ = zss + (z - zss) e^(-|dx|/|zss|)`, so that no speed makes it unstable. The law itself can give
//! out energy where `b < sigma1 (Fs/Fd - 1)` (Barabanov and Ortega 2000), which the [adviser](crate::adviser) checks.

use super::bristle::{AlwaysPlastic, Bristle};
use super::level::{Level, Stribeck};
use super::{Directional, Slot};
use crate::parameters::Parameter;

/// LuGre friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Lugre {
    /// `Fs`, N: the most that the bristle holds at rest.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Fd` (LuGre's `Fc`), N: what it holds in fast motion; not above `Fs`.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `ws` (Stribeck's velocity), m/s; above 0 where `Fs` and `Fd` differ.
    #[cfg_attr(feature = "serde", serde(alias = "ws", alias = "vs", default))]
    pub stribeck_velocity: f64,
    /// `sigma0`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `sigma1`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "sigma1", alias = "beta", default))]
    pub contact_damping: f64,
    /// `b` (LuGre's `sigma2`), N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
}

impl Lugre {
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::StribeckVelocity => Some(Slot::One(&mut self.stribeck_velocity)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ContactDamping => Some(Slot::One(&mut self.contact_damping)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    /// Stribeck's curve, where there is one.
    pub(crate) fn curve(&self) -> Option<Stribeck> {
        (self.static_force != self.dynamic_force).then_some(Stribeck {
            static_force: self.static_force,
            dynamic_force: self.dynamic_force,
            velocity: self.stribeck_velocity,
        })
    }

    pub(crate) fn contact<L: Level>(&self, level: L) -> Bristle<L, AlwaysPlastic> {
        Bristle {
            level,
            plasticity: AlwaysPlastic,
            stiffness: self.contact_stiffness,
            damping: self.contact_damping,
            viscous: self.viscous,
            deflection: 0.0,
        }
    }
}
