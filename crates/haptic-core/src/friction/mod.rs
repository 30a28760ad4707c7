//! Friction laws, one file each: what the law is made of, where it comes from, and how its contact moves on.
//!
//! | law | rest | sliding | memory |
//! |---|---|---|---|
//! | [`Karnopp`] | rigid behind a block, a stuck spring on the device | `Fd + b w`, with Stribeck's fall from `Fs` where wanted | whether it is stuck, and for how long |
//! | [`Dahl`] | none: yields from the start | `Fd + b w` | the force |
//! | [`HaywardArmstrong`] | elastic, then yielding | `Fd + b w` | the deflection |
//! | [`ResetIntegrator`] | a spring and a damper | `Fd + b w` | the deflection |
//! | [`Lugre`] | a yielding bristle | Stribeck's curve | the deflection |
//! | [`ElastoPlastic`] | an elastic bristle | Stribeck's curve | the deflection |
//! | [`SalcudeanVlaar`] | a stuck spring | `b w` | whether it is stuck, and the spring's force |
//! | [`Viscous`] | none | `b w` | none |

mod bristle;
pub(crate) mod contact;
mod dahl;
mod directional;
mod elasto_plastic;
mod hayward_armstrong;
mod karnopp;
pub(crate) mod level;
mod lugre;
mod reset_integrator;
mod salcudean_vlaar;
mod spring_contact;
pub(crate) mod static_limit;
mod viscous;

pub use dahl::Dahl;
pub use directional::Directional;
pub use elasto_plastic::ElastoPlastic;
pub use hayward_armstrong::HaywardArmstrong;
pub use karnopp::{DEFAULT_CONTACT_STIFFNESS, Karnopp};
pub use level::SUDDEN_FALL_MPS;
pub use lugre::Lugre;
pub use reset_integrator::{MOST_STICTION, ResetIntegrator};
pub use salcudean_vlaar::SalcudeanVlaar;
pub use viscous::Viscous;

use crate::parameters::{Direction, Parameter};
use level::{Level, Stribeck};

/// What a stuck spring is anchored to when a slide ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Reseat {
    /// Where the spring has the force that there was: the force is continuous.
    #[default]
    Continuous,
    /// Where the spring has the whole static force, as the paper's slides print it and as Haessig and Friedland's model has it. The
    /// force jumps by `Fs - Fd` at each re-stick, and energy of `(Fs^2 - Fd^2)/2 Kp` comes from nowhere: for reproduction only.
    #[cfg_attr(feature = "serde", serde(alias = "published"))]
    Slides,
}

/// The friction law of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(tag = "law", rename_all = "kebab-case"))]
pub enum Friction {
    /// Stiction, kinetic and viscous friction with a true stuck state.
    Karnopp(Karnopp),
    /// A hysteretic spring that yields from the start.
    Dahl(Dahl),
    /// A position-based bristle that does not drift with noise.
    HaywardArmstrong(HaywardArmstrong),
    /// A bristle that holds up to its length and then slides.
    ResetIntegrator(ResetIntegrator),
    /// A bristle with Stribeck's curve.
    Lugre(Lugre),
    /// A bristle with Stribeck's curve that is elastic at first.
    ElastoPlastic(ElastoPlastic),
    /// A stuck spring that slides without kinetic friction.
    SalcudeanVlaar(SalcudeanVlaar),
    /// Drag alone.
    Viscous(Viscous),
}

/// The names of the laws, in the order of this module's table.
pub const LAWS: [&str; 8] = [
    "karnopp",
    "dahl",
    "hayward-armstrong",
    "reset-integrator",
    "lugre",
    "elasto-plastic",
    "salcudean-vlaar",
    "viscous",
];

/// Where a parameter of a scene is kept.
#[derive(Debug)]
pub(crate) enum Slot<'a> {
    /// One value.
    One(&'a mut f64),
    /// One that may differ by direction.
    Two(&'a mut Directional),
}

impl Friction {
    /// The law's name in scene files and on the wire.
    #[must_use]
    pub const fn law(&self) -> &'static str {
        match self {
            Self::Karnopp(_) => "karnopp",
            Self::Dahl(_) => "dahl",
            Self::HaywardArmstrong(_) => "hayward-armstrong",
            Self::ResetIntegrator(_) => "reset-integrator",
            Self::Lugre(_) => "lugre",
            Self::ElastoPlastic(_) => "elasto-plastic",
            Self::SalcudeanVlaar(_) => "salcudean-vlaar",
            Self::Viscous(_) => "viscous",
        }
    }

    /// Where the law keeps a parameter, if it has it. `on_device` where there is no block.
    pub(crate) fn slot(&mut self, parameter: Parameter, on_device: bool) -> Option<Slot<'_>> {
        match self {
            Self::Karnopp(law) => law.slot(parameter, on_device),
            Self::Dahl(law) => law.slot(parameter),
            Self::HaywardArmstrong(law) => law.slot(parameter),
            Self::ResetIntegrator(law) => law.slot(parameter),
            Self::Lugre(law) => law.slot(parameter),
            Self::ElastoPlastic(law) => law.slot(parameter),
            Self::SalcudeanVlaar(law) => law.slot(parameter),
            Self::Viscous(law) => law.slot(parameter),
        }
    }

    /// The law's own limits of static friction, by direction, N; zero where nothing holds.
    #[must_use]
    pub fn holding_force(&self) -> Directional {
        match self {
            Self::Karnopp(law) => law.breakaway_force(),
            Self::Dahl(law) => law.dynamic_force,
            Self::HaywardArmstrong(law) => law.dynamic_force,
            Self::ResetIntegrator(law) => law.static_force,
            Self::Lugre(law) => law.static_force,
            Self::ElastoPlastic(law) => law.static_force,
            Self::SalcudeanVlaar(law) => law.static_force,
            Self::Viscous(_) => Directional::both(0.0),
        }
    }

    /// The force that keeps a slide at a steady velocity going, N, positive for a positive one: what a plot of force against velocity shows once
    /// nothing accelerates. At rest nothing slides, so 0 m/s counts as the slowest slide in the positive direction.
    #[must_use]
    pub fn steady_force(&self, velocity_mps: f64) -> f64 {
        let (direction, speed) = (Direction::of(velocity_mps), velocity_mps.abs());
        let kinetic = |level: Directional, curve: Option<Stribeck>| {
            curve.map_or(level.get(direction), |curve| curve.at(direction, speed))
        };
        let none = Directional::both(0.0);
        let (level, viscous) = match self {
            Self::Karnopp(law) => (kinetic(law.dynamic_force, law.curve()), law.viscous),
            Self::Dahl(law) => (law.dynamic_force.get(direction), law.viscous),
            Self::HaywardArmstrong(law) => (law.dynamic_force.get(direction), law.viscous),
            Self::ResetIntegrator(law) => (law.dynamic_force.get(direction), law.viscous),
            Self::Lugre(law) => (kinetic(law.dynamic_force, law.curve()), law.viscous),
            Self::ElastoPlastic(law) => (kinetic(law.dynamic_force, law.curve()), law.viscous),
            Self::SalcudeanVlaar(law) => (none.get(direction), law.viscous),
            Self::Viscous(law) => (none.get(direction), law.viscous),
        };
        direction.sign() * (level + viscous.get(direction) * speed)
    }

    /// Stiffness with which the contact itself gives way at most, N/m: 0 where it is rigid behind a block, or does not hold at all.
    #[must_use]
    pub fn contact_stiffness(&self, on_device: bool) -> f64 {
        match self {
            Self::Karnopp(law) if on_device => law.contact_stiffness.unwrap_or(karnopp::DEFAULT_CONTACT_STIFFNESS),
            Self::Karnopp(_) | Self::Viscous(_) => 0.0,
            Self::Dahl(law) => law.contact_stiffness,
            Self::HaywardArmstrong(law) => law.contact_stiffness,
            Self::ResetIntegrator(law) => law.stuck_stiffness().greatest(),
            Self::Lugre(law) => law.contact_stiffness,
            Self::ElastoPlastic(law) => law.contact_stiffness,
            Self::SalcudeanVlaar(law) => law.contact_stiffness,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_slide_has_the_force_that_its_law_says() {
        let mut law = Karnopp::new(
            4.0,
            Directional {
                positive: 3.0,
                negative: 2.0,
            },
        );
        law.viscous = Directional::both(10.0);
        let plain = Friction::Karnopp(law);
        assert_eq!(plain.steady_force(0.1), 4.0);
        assert_eq!(plain.steady_force(-0.1), -3.0);
        law.stribeck_velocity = 0.01;
        let falling = Friction::Karnopp(law);
        assert_eq!(falling.steady_force(0.0), 4.0);
        assert!((falling.steady_force(0.01) - (3.0 + (-1.0_f64).exp() + 0.1)).abs() < 1e-12);
        assert_eq!(falling.steady_force(1.0), 13.0);
    }

    #[test]
    fn drag_alone_is_a_straight_line() {
        let drag = Friction::Viscous(Viscous {
            viscous: Directional::both(2.0),
        });
        assert_eq!([drag.steady_force(-1.5), drag.steady_force(0.0)], [-3.0, 0.0]);
    }
}
