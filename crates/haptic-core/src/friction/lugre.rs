//! LuGre friction (Canudas de Wit, Olsson, Astrom and Lischinsky 1995, "A new model for control of
//! systems with friction").
//!
//! ```text
//! z' = v - sigma0 |v| z/g(v),   F = sigma0 z + sigma1 z' + b v,   g(v) = Fd + (Fs - Fd) e^-(v/ws)^2
//! ```
//!
//! At a constant speed the bristle moves on by `z+ = zss + (z - zss) e^(-|dx|/|zss|)`, so that no
//! speed makes it unstable. The law itself can give out energy where
//! `b < sigma1 (Fs/Fd - 1)` (Barabanov and Ortega 2000), which the [adviser](crate::adviser)
//! checks.

use super::forces::StribeckForces;
use super::law::{self, Law, LawKind};
use crate::block::{Piece, PiecewiseContact, Start};
use crate::contact::{
    Bristle, BristleForce, DeviceLugre, FallSeries, FlowLevel, FullPlasticity, LawContact, Level, RatioSeries,
    TowardsLimit, UnderCurve,
};
use crate::directional::{Direction, Directional};
use crate::parameters::{Parameter, SceneError, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use crate::series::DEFAULT_TOLERANCE_N;
use alloc::boxed::Box;

/// LuGre friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    fn forces(&self) -> StribeckForces {
        StribeckForces {
            static_force: self.static_force,
            dynamic_force: self.dynamic_force,
            velocity: self.stribeck_velocity,
        }
    }

    fn contact<L: Level>(&self, level: L) -> Bristle<L, FullPlasticity> {
        Bristle {
            level,
            plasticity: FullPlasticity,
            stiffness: self.contact_stiffness,
            damping: self.contact_damping,
            viscous: self.viscous,
            deflection: 0.0,
        }
    }

    fn device_contact<L: FlowLevel>(&self, level: L) -> DeviceLugre<L> {
        DeviceLugre {
            level,
            stiffness: self.contact_stiffness,
            damping: self.contact_damping,
            viscous: self.viscous,
            force: 0.0,
        }
    }
}

impl LawKind for Lugre {
    const NAME: &'static str = "lugre";
    const SUMMARY: &'static str =
        "A bristle that yields, with stiction and Stribeck's fall (Canudas de Wit et al. 1995)";

    fn defaults() -> Self {
        Self {
            static_force: Directional::both(law::STATIC_FORCE),
            dynamic_force: Directional::both(law::DYNAMIC_FORCE),
            stribeck_velocity: law::STRIBECK_VELOCITY_MPS,
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            contact_damping: law::CONTACT_DAMPING,
            viscous: Directional::both(0.0),
        }
    }
}

impl Law for Lugre {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
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

    fn validate(&self, _on_device: bool) -> Result<(), SceneError> {
        self.forces().check(Self::NAME)
    }

    fn comply(&mut self) {
        (self.static_force, self.stribeck_velocity) = self.forces().complied();
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

    fn passive_from(&self, direction: Direction) -> Option<f64> {
        Some(self.forces().passive_from(direction, self.contact_damping))
    }

    fn damping_of_curve(&self) -> Option<f64> {
        Some(self.viscous.greatest() + self.contact_damping)
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        match self.forces().curve() {
            None => self.yielding(block, self.contact(self.dynamic_force)),
            Some(curve) => self.yielding(block, self.contact(curve)),
        }
    }

    fn on_device(&self) -> Box<dyn Surface> {
        match self.forces().curve() {
            None => Box::new(DeviceSurface::new(self.device_contact(self.dynamic_force))),
            Some(curve) => Box::new(DeviceSurface::new(self.device_contact(curve))),
        }
    }
}

impl<L: Level> PiecewiseContact for Bristle<L, FullPlasticity> {
    fn piece(&mut self, start: &Start) -> Piece {
        let direction = start.direction;
        let along = direction.sign() * self.force_at_rest();
        let kinetic = self.level.kinetic(direction);
        let fall = self.level.fall(direction);
        let falls_to = fall.map_or(0.0, |fall| fall.fallen_from);
        match fall.filter(|_| start.speed <= falls_to && falls_to > 0.0) {
            None if kinetic == 0.0 && along != 0.0 => self.let_go(start),
            None if self.is_settled(along, kinetic) => self.slide(start, falls_to),
            None => {
                let bristle = BristleForce::<true>::new(start.remaining_s, self.stiffness, self.damping, along);
                let mut series = TowardsLimit::new(bristle, kinetic, DEFAULT_TOLERANCE_N);
                let mut expansion = start.expand(self.viscous.get(direction), &mut series);
                let speed = expansion.falls_to(falls_to).then_some(falls_to);
                self.bend(start, &expansion, speed, &series.bristle)
            }
            Some(fall) => {
                let bristle = BristleForce::<true>::new(start.remaining_s, self.stiffness, self.damping, along);
                let ratio = RatioSeries::new(along, kinetic, Some(FallSeries::new(&fall, start.speed)));
                let mut series = UnderCurve {
                    bristle,
                    ratio,
                    tolerance_n: DEFAULT_TOLERANCE_N,
                };
                let mut expansion = start.expand(self.viscous.get(direction), &mut series);
                let speed = expansion.falls_to(0.0).then_some(0.0);
                self.bend(start, &expansion, speed, &series.bristle)
            }
        }
    }
}
