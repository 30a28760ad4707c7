//! Friction laws, one file each: the law's parameters, its source, and its contact.
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
//!
//! To add a law, write its file, which implements the traits of `law.rs`, and add its two lines
//! below: the module and the entry in the list.

mod bristle_pieces;
mod dahl;
mod elasto_plastic;
mod forces;
mod hayward_armstrong;
mod karnopp;
mod law;
mod lugre;
mod reset_integrator;
mod salcudean_vlaar;
mod viscous;

pub use crate::contact::{Reseat, SUDDEN_FALL_MPS};
pub use forces::MAX_STICTION;
pub use law::DEFAULT_CONTACT_STIFFNESS;

pub(crate) use law::Law;

use crate::directional::{Direction, Directional};
use crate::parameters::{Parameter, ParameterKey, Slot, TABLE};
use alloc::vec::Vec;
use law::LawKind;

/// Makes [`Friction`], [`LAWS`] and all that tells one law from another.
macro_rules! laws {
    ($($(#[$about:meta])* $law:ident in $file:ident,)+) => {
        $($(#[$about])* pub use $file::$law;)+

        /// The friction law of a scene.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[cfg_attr(feature = "serde", serde(tag = "law", rename_all = "kebab-case"))]
        #[non_exhaustive]
        pub enum Friction {
            $($(#[$about])* $law($law),)+
        }

        /// The names of the laws, in the order of this module's table.
        pub const LAWS: [&str; [$($law::NAME,)+].len()] = [$($law::NAME,)+];

        impl Friction {
            /// The law's name in scene files and on the wire.
            #[must_use]
            pub const fn law(&self) -> &'static str {
                match self { $(Self::$law(_) => $law::NAME,)+ }
            }

            /// The law of this name with the paper's forces; `None` for an unknown name.
            #[must_use]
            pub fn default_of(law: &str) -> Option<Self> {
                $(if law == $law::NAME { return Some(Self::$law($law::defaults())); })+
                None
            }

            /// The idea of the law of this name in one line, with its source; `None` for an unknown
            /// name.
            #[must_use]
            pub fn summary(law: &str) -> Option<&'static str> {
                $(if law == $law::NAME { return Some($law::SUMMARY); })+
                None
            }

            pub(crate) fn as_law(&self) -> &dyn Law {
                match self { $(Self::$law(law) => law,)+ }
            }

            pub(crate) fn as_law_mut(&mut self) -> &mut dyn Law {
                match self { $(Self::$law(law) => law,)+ }
            }
        }
    };
}

laws! {
    /// Truly stuck, or sliding.
    Karnopp in karnopp,
    /// A spring that yields from the start.
    Dahl in dahl,
    /// A bristle that does not drift with noise.
    HaywardArmstrong in hayward_armstrong,
    /// A bristle that holds, then slides.
    ResetIntegrator in reset_integrator,
    /// A bristle with Stribeck's curve.
    Lugre in lugre,
    /// The same, elastic at first.
    ElastoPlastic in elasto_plastic,
    /// A spring that slides with drag alone.
    SalcudeanVlaar in salcudean_vlaar,
    /// Drag alone.
    Viscous in viscous,
}

/// One number of a law's parameter vector, with its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// The parameter, with its direction where it may differ by direction.
    pub key: ParameterKey,
    /// Its value, in the parameter's unit.
    pub value: f64,
    /// The smallest value accepted.
    pub min: f64,
    /// The largest value accepted.
    pub max: f64,
}

impl Friction {
    /// The place of a parameter's value; `None` where the law lacks the parameter. `on_device`
    /// where the scene has no block.
    pub(crate) fn slot(&mut self, parameter: Parameter, on_device: bool) -> Option<Slot<'_>> {
        self.as_law_mut().slot(parameter, on_device)
    }

    /// The law's parameter vector, in the order of the table, directions apart and positive first.
    /// `on_device` where the scene has no block.
    #[must_use]
    pub fn vector(&self, on_device: bool) -> Vec<Coordinate> {
        let mut law = *self;
        let mut vector = Vec::new();
        for row in &TABLE {
            let mut push = |key: ParameterKey, value| {
                vector.push(Coordinate {
                    key,
                    value,
                    min: row.min,
                    max: row.max,
                });
            };
            match law.slot(row.parameter, on_device) {
                Some(Slot::One(value)) => push(row.parameter.into(), *value),
                Some(Slot::Two(value)) => {
                    for direction in Direction::BOTH {
                        push(row.parameter.in_direction(direction), value.get(direction));
                    }
                }
                None => {}
            }
        }
        vector
    }

    /// The law's own limits of static friction, by direction, N; zero where nothing holds.
    #[must_use]
    pub fn holding_force(&self) -> Directional {
        self.as_law().holding_force()
    }

    /// The force that keeps a slide at a steady velocity (m/s) going, N, positive for a positive
    /// velocity: a plot of force against velocity shows it once nothing accelerates. Nothing slides
    /// at rest, so 0 m/s counts as the slowest slide in the positive direction.
    #[must_use]
    pub fn steady_force(&self, velocity_mps: f64) -> f64 {
        let direction = Direction::of(velocity_mps);
        direction.sign() * self.as_law().steady_friction(direction, velocity_mps.abs())
    }

    /// Greatest stiffness with which the contact gives way, N/m: 0 for a contact that is rigid
    /// behind a block, or holds nothing.
    #[must_use]
    pub fn contact_stiffness(&self, on_device: bool) -> f64 {
        self.as_law().contact_stiffness(on_device)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::exp;

    #[test]
    fn a_steady_slide_has_the_force_that_its_law_says() {
        let mut law = Karnopp::new(4.0, Directional::new(3.0, 2.0));
        law.viscous = Directional::both(10.0);
        let plain = Friction::Karnopp(law);
        assert_eq!(plain.steady_force(0.1), 4.0);
        assert_eq!(plain.steady_force(-0.1), -3.0);
        law.stribeck_velocity = 0.01;
        let forces = Friction::Karnopp(law);
        assert_eq!(forces.steady_force(0.0), 4.0);
        assert!((forces.steady_force(0.01) - (3.0 + exp(-1.0) + 0.1)).abs() < 1e-12);
        assert_eq!(forces.steady_force(1.0), 13.0);
        let viscous = Directional::both(2.0);
        assert_eq!(Friction::Viscous(Viscous { viscous }).steady_force(-1.5), -3.0);
    }

    #[test]
    fn a_vector_has_every_parameter_in_each_of_its_directions() {
        let vector = Friction::Karnopp(Karnopp::new(4.0, 3.5)).vector(false);
        assert_eq!(
            vector.len(),
            2 + 2 + 2 + 3,
            "two of each force and of the drag, DV, ws and gamma: {vector:?}"
        );
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_laws_name_is_its_tag_on_the_wire() {
        for name in LAWS {
            let law = Friction::default_of(name).expect("a law of the list");
            let json = serde_json::to_value(law).expect("writes");
            assert_eq!(json["law"], name);
            assert_eq!(serde_json::from_value::<Friction>(json).expect("reads"), law);
        }
    }
}
