//! The scene's data, and access to its parameters by name.

use crate::block::{Block, Coupling};
use crate::directional::{Direction, Directional};
use crate::friction::{Friction, Karnopp};
use crate::parameters::{NotApplicable, Parameter, ParameterInfo, ParameterKey, SceneError, Slot, TABLE};
use alloc::string::String;
use alloc::vec::Vec;

/// A scene: what the rig shall feel like. Its fields have the names of the TOML file.
///
/// A scene is plain data and may hold anything; [`Scene::validate`] says whether it can be
/// rendered, and [`Renderer::new`](crate::Renderer::new) takes no scene that cannot.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Scene {
    /// What people call it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub name: String,
    /// The block; without one, friction acts on the device itself.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub block: Option<Block>,
    /// How the hand holds the block.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub coupling: Option<Coupling>,
    /// What it slides on.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "super::friction_fields::read"))]
    pub friction: Friction,
}

impl Scene {
    /// A light block on the paper's surface, with a grip that light rigs and those behind a USB link can bear.
    #[must_use]
    pub fn light_block() -> Self {
        Self {
            name: String::from("light block"),
            block: Some(Block { mass: 0.1 }),
            coupling: Some(Coupling::CALM),
            friction: Friction::Karnopp(Karnopp::new(4.0, 3.5)),
        }
    }

    /// The paper's block: 0.5 kg on a surface with 4 N of stiction and 3.5 N of kinetic friction.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            name: String::from("simulated friction"),
            block: Some(Block { mass: 0.5 }),
            coupling: Some(Coupling {
                stiffness: 25_000.0,
                damping: 10.0,
            }),
            friction: Friction::Karnopp(Karnopp::new(4.0, 3.5)),
        }
    }

    /// Whether friction acts on the device itself.
    #[must_use]
    pub fn is_on_device(&self) -> bool {
        self.block.is_none()
    }

    /// The place of a parameter's value; `None` where the scene lacks the parameter.
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        let on_device = self.is_on_device();
        match parameter {
            Parameter::Mass => self.block.as_mut().map(|block| Slot::One(&mut block.mass)),
            Parameter::Stiffness => self.coupling.as_mut().map(|held| Slot::One(&mut held.stiffness)),
            Parameter::Damping => self.coupling.as_mut().map(|held| Slot::One(&mut held.damping)),
            _ => self.friction.slot(parameter, on_device),
        }
    }

    /// The value of a parameter; `None` where the scene lacks it. A parameter without directions
    /// holds the same number in both.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> Option<Directional> {
        let (mut friction, mut block, mut coupling) = (self.friction, self.block, self.coupling);
        let slot = match parameter {
            Parameter::Mass => block.as_mut().map(|block| Slot::One(&mut block.mass)),
            Parameter::Stiffness => coupling.as_mut().map(|held| Slot::One(&mut held.stiffness)),
            Parameter::Damping => coupling.as_mut().map(|held| Slot::One(&mut held.damping)),
            _ => friction.slot(parameter, self.is_on_device()),
        };
        slot.map(|slot| match slot {
            Slot::One(value) => Directional::both(*value),
            Slot::Two(value) => *value,
        })
    }

    /// The parameters that the scene has, in the order of the table.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let has = |row: &&ParameterInfo| self.value(row.parameter).is_some();
        TABLE.iter().filter(has).map(|row| row.parameter).collect()
    }

    /// The refusal of a parameter that the scene lacks.
    pub(super) fn not_applicable(&self, param: ParameterKey) -> SceneError {
        let reason = match param.parameter {
            Parameter::Mass | Parameter::Stiffness | Parameter::Damping => NotApplicable::NoBlock,
            other => self
                .friction
                .as_law()
                .why_lacking(other)
                .unwrap_or(NotApplicable::Law(self.friction.law())),
        };
        SceneError::NotApplicable {
            param,
            reason,
            has: self.parameters(),
        }
    }

    /// Sets a parameter, or one direction of it.
    pub(super) fn set_value(&mut self, key: ParameterKey, value: f64) -> Result<(), SceneError> {
        let Some(slot) = self.slot(key.parameter) else {
            return Err(self.not_applicable(key));
        };
        match slot {
            Slot::One(kept) => *kept = value,
            Slot::Two(kept) => {
                if key.direction != Some(Direction::Negative) {
                    kept.positive = value;
                }
                if key.direction != Some(Direction::Positive) {
                    kept.negative = value;
                }
            }
        }
        Ok(())
    }
}
