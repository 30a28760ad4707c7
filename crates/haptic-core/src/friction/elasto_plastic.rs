//! Elasto-plastic friction (Dupont, Hayward, Armstrong and Altpeter 2002, "Single state
//! elastoplastic friction models"): LuGre's bristle, but truly elastic up to a breakaway
//! deflection, and elastic whenever it is unloaded. A load that shakes below the limit does not
//! make it creep.
//!
//! ```text
//! z' = v (1 - alpha(z, v) sigma0 z sgn(v)/g(v)),   F = sigma0 z + sigma1 z' + b v
//! alpha = 0 up to zba and wherever z and v are opposed, 1 from zmax on, and half a sine wave in between
//! ```

use super::forces::StribeckForces;
use super::law::{Law, LawKind};
use super::usual;
use crate::contact::{
    Bristle, DeviceElastoPlastic, Level, MasterLaw, ORDER, PathBristle, Plasticity, Series, flow_in_pieces,
    series_product,
};
use crate::direction::Direction;
use crate::directional::Directional;
use crate::math::{cos, sin_cos};
use crate::parameters::{Parameter, SceneError, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use alloc::boxed::Box;
use core::f64::consts::PI;

/// Elasto-plastic friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ElastoPlastic {
    /// `Fs`, N: the most that the bristle holds at rest.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Fd`, N: what it holds in fast motion; not above `Fs`.
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
    /// `zba` over the steady deflection `g(v)/sigma0` of the moment: the share up to which nothing
    /// flows.
    #[cfg_attr(
        feature = "serde",
        serde(alias = "zba", alias = "zs", default = "crate::friction::usual::elastic_fraction")
    )]
    pub elastic_fraction: f64,
    /// `b` (`sigma2`), N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
}

impl ElastoPlastic {
    fn forces(&self) -> StribeckForces {
        StribeckForces {
            static_force: self.static_force,
            dynamic_force: self.dynamic_force,
            velocity: self.stribeck_velocity,
        }
    }

    fn contact<L: Level>(&self, level: L) -> Bristle<L, DelayedPlasticity> {
        Bristle {
            level,
            plasticity: DelayedPlasticity {
                fraction: self.elastic_fraction,
            },
            stiffness: self.contact_stiffness,
            damping: self.contact_damping,
            viscous: self.viscous,
            deflection: 0.0,
        }
    }
}

impl LawKind for ElastoPlastic {
    const NAME: &'static str = "elasto-plastic";

    fn usual() -> Self {
        Self {
            static_force: Directional::both(usual::STATIC_FORCE),
            dynamic_force: Directional::both(usual::DYNAMIC_FORCE),
            stribeck_velocity: usual::STRIBECK_VELOCITY_MPS,
            contact_stiffness: usual::DEFAULT_CONTACT_STIFFNESS,
            contact_damping: usual::CONTACT_DAMPING,
            elastic_fraction: usual::ELASTIC_FRACTION,
            viscous: Directional::both(0.0),
        }
    }
}

impl Law for ElastoPlastic {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::StribeckVelocity => Some(Slot::One(&mut self.stribeck_velocity)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ContactDamping => Some(Slot::One(&mut self.contact_damping)),
            Parameter::ElasticFraction => Some(Slot::One(&mut self.elastic_fraction)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    fn validate(&self, _on_device: bool) -> Result<(), SceneError> {
        self.forces().check(Self::NAME)
    }

    fn comply(&mut self) {
        let StribeckForces {
            static_force, velocity, ..
        } = self.forces().complied();
        (self.static_force, self.stribeck_velocity) = (static_force, velocity);
    }

    fn holding_force(&self) -> Directional {
        self.static_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.forces().at(direction, speed) + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.contact_stiffness
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        let (stiffness, holds) = (self.contact_stiffness(false), self.holding_force().greatest());
        match self.forces().curve() {
            None => block.yielding(self.contact(self.dynamic_force), stiffness, holds),
            Some(curve) => block.yielding(self.contact(curve), stiffness, holds),
        }
    }

    fn on_device(&self) -> Box<dyn Surface> {
        let law = DelayedPlasticity {
            fraction: self.elastic_fraction,
        };
        let (stiffness, damping) = (self.contact_stiffness, self.contact_damping);
        match self.forces().curve() {
            None => {
                let contact = PathBristle::new(law, self.dynamic_force, stiffness, damping, self.viscous);
                Box::new(DeviceSurface::new(contact))
            }
            Some(curve) => {
                let fraction = self.elastic_fraction;
                let contact = DeviceElastoPlastic::new(law, fraction, curve, stiffness, damping, self.viscous);
                Box::new(DeviceSurface::new(contact))
            }
        }
    }
}

/// `alpha`, by the share of the steady deflection at which it begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DelayedPlasticity {
    fraction: f64,
}

impl Plasticity for DelayedPlasticity {
    const EXACT: bool = false;
    const UNLOADS_ELASTICALLY: bool = true;

    fn alpha(&self, deflection: f64, steady: f64) -> f64 {
        let ratio = deflection / steady;
        if ratio <= self.fraction {
            0.0
        } else if ratio >= 1.0 {
            1.0
        } else {
            let share = (ratio - self.fraction) / (1.0 - self.fraction);
            0.5 * (1.0 - cos(PI * share))
        }
    }

    fn share_slope(&self, ratio: f64) -> f64 {
        if ratio <= self.fraction {
            0.0
        } else if ratio >= 1.0 {
            -1.0
        } else {
            let angle = PI * (ratio - self.fraction) / (1.0 - self.fraction);
            let (sin, cos) = sin_cos(angle);
            -0.5 * (1.0 - cos) - ratio * 0.5 * PI / (1.0 - self.fraction) * sin
        }
    }

    fn elastic_up_to(&self, steady: f64) -> Option<f64> {
        Some(self.fraction * steady)
    }

    fn flow(&self, deflection: f64, distance: f64, steady: f64) -> (f64, u32) {
        let elastic = (self.fraction * steady - deflection).max(0.0).min(distance);
        let deflection = deflection + elastic;
        let plastic = distance - elastic;
        if plastic <= 0.0 {
            return (deflection, 1);
        }
        flow_in_pieces(deflection, plastic, steady, |z| self.alpha(z, steady))
    }
}

/// Over `X`, by the recurrences of sine and cosine.
impl MasterLaw for DelayedPlasticity {
    const UNLOADS_ELASTICALLY: bool = true;

    fn rate(&self, u: f64) -> f64 {
        1.0 - self.alpha(u, 1.0) * u
    }

    fn series(&self, start: f64) -> Series {
        let angle = PI / (1.0 - self.fraction);
        let mut u = [0.0; ORDER + 1];
        // `k u[k]`
        let mut turns = u;
        let (mut sin, mut cos) = (u, u);
        u[0] = start;
        (sin[0], cos[0]) = sin_cos(angle * (start - self.fraction));
        let mut order = 0.0;
        for n in 0..ORDER {
            if n > 0 {
                turns[n] = order * u[n];
                let (of_sin, of_cos) = (
                    series_product(&turns[1..=n], &cos[..n]),
                    series_product(&turns[1..=n], &sin[..n]),
                );
                (sin[n], cos[n]) = (angle * of_sin / order, -angle * of_cos / order);
            }
            let turned = series_product(&cos[..=n], &u[..=n]);
            let elastic = if n == 0 { 1.0 } else { 0.0 };
            order += 1.0;
            u[n + 1] = (elastic - 0.5 * (u[n] - turned)) / order;
        }
        u
    }

    fn elastic_up_to(&self) -> Option<f64> {
        Some(self.fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cells_and_error;
    use std::println;

    #[test]
    fn the_master_path_is_the_law_wherever_its_elastic_part_ends() {
        for fraction in [0.0, 1e-3, 0.3, 0.7, 0.9, 0.99] {
            let (cells, error) = cells_and_error(&DelayedPlasticity { fraction }, fraction);
            println!("{fraction}: {cells} cells, {error:.1e}");
            assert!(cells < 500 && error < 1e-13, "{fraction}: {cells} cells, {error:e}");
        }
    }
}
