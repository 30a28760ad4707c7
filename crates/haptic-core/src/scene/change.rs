//! A scene with some parameters changed.
//!
//! The scene's data, and access to its parameters by name.

use crate::block::{Block, Coupling};
use crate::directional::{Direction, Directional};
use crate::friction::{Friction, Karnopp};
use crate::parameters::{NotApplicable, Parameter, ParameterInfo, ParameterKey, SceneError, Slot, TABLE, check_range};
use alloc::string::String;
use alloc::vec::Vec;

impl Scene {
    /// The scene with some parameters changed: all of them, or none when one is refused.
    ///
    /// # Errors
    /// The first reason why the changed scene cannot be rendered, or [`SceneError::GivenTwice`].
    pub fn with(&self, changes: &[(ParameterKey, f64)]) -> Result<Self, SceneError> {
        let changed = self.with_unvalidated(changes)?;
        changed.validate()?;
        Ok(changed)
    }

    /// The same, but only the changed values are checked: for a scene that is compiled next, which
    /// validates it as a whole.
    ///
    /// # Errors
    /// A value is out of its range, does not apply to the scene, or is given twice.
    pub fn with_unvalidated(&self, changes: &[(ParameterKey, f64)]) -> Result<Self, SceneError> {
        let mut changed = self.clone();
        let mut seen: Vec<(Parameter, Direction)> = Vec::with_capacity(2 * changes.len());
        for &(key, value) in changes {
            for direction in Direction::BOTH {
                if key.direction.is_none_or(|only| only == direction) {
                    if seen.contains(&(key.parameter, direction)) {
                        return Err(SceneError::GivenTwice { param: key });
                    }
                    seen.push((key.parameter, direction));
                }
            }
            // Checked here, so that the message names the direction as the user gave it.
            check_range(key, value)?;
            changed.set_value(key, value)?;
        }
        Ok(changed)
    }
}

/// What the rig feels like, with the field names of its TOML file.
///
/// A scene is plain data and may hold anything; [`Scene::validate`] says whether it can be
/// rendered, and [`Renderer::new`](crate::Renderer::new) takes no scene that cannot.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
        place(parameter, &mut self.block, &mut self.coupling, &mut self.friction)
    }

    /// The value of a parameter; `None` where the scene lacks it. A parameter without directions
    /// holds the same number in both.
    #[must_use]
    pub fn value(&self, parameter: Parameter) -> Option<Directional> {
        let (mut block, mut coupling, mut friction) = (self.block, self.coupling, self.friction);
        let slot = place(parameter, &mut block, &mut coupling, &mut friction)?;
        Some(match slot {
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

/// The place of a parameter's value in the parts of a scene.
fn place<'a>(
    parameter: Parameter,
    block: &'a mut Option<Block>,
    coupling: &'a mut Option<Coupling>,
    friction: &'a mut Friction,
) -> Option<Slot<'a>> {
    match parameter {
        Parameter::Mass => block.as_mut().map(|block| Slot::One(&mut block.mass)),
        Parameter::Stiffness => coupling.as_mut().map(|held| Slot::One(&mut held.stiffness)),
        Parameter::Damping => coupling.as_mut().map(|held| Slot::One(&mut held.damping)),
        _ => friction.slot(parameter, block.is_none()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Renderer, Scheme};
    use alloc::string::ToString;

    fn key(text: &str) -> ParameterKey {
        text.parse().expect("a parameter")
    }

    #[test]
    fn a_change_is_all_or_nothing_and_names_the_limit() {
        let scene = Scene::paper();
        let error = scene
            .with(&[(key("Fs"), 5.0), (key("mass"), -1.0)])
            .expect_err("a negative mass");
        let message = error.to_string();
        for part in ["mass", "-1", "0.000001", "100", "kg"] {
            assert!(message.contains(part), "{message} lacks {part}");
        }
        assert_eq!(scene, Scene::paper());
    }

    #[test]
    fn directions_are_set_apart_and_only_once() {
        let scene = Scene::paper()
            .with(&[(key("Fs+"), 5.0), (key("Fs-"), 3.0)])
            .expect("both directions");
        let limits = scene.value(Parameter::StaticForce).expect("Karnopp has it");
        assert_eq!((limits.positive, limits.negative), (5.0, 3.0));
        let notes = scene.notes();
        assert_eq!(notes.len(), 1, "Fs- = 3 N lies below Fd = 3.5 N: {notes:?}");
        let twice = Scene::paper().with(&[(key("Fs"), 5.0), (key("static_force-"), 3.0)]);
        assert!(matches!(twice, Err(SceneError::GivenTwice { .. })));
    }

    #[test]
    fn what_cannot_be_rendered_is_refused() {
        let scene = Scene::paper();
        assert!(matches!(
            scene.with(&[(key("Fd"), f64::NAN)]),
            Err(SceneError::NotFinite { .. })
        ));
        assert_eq!(
            scene.with(&[(key("K"), 0.0), (key("B"), 0.0)]),
            Err(SceneError::NoCoupling)
        );
        assert!(scene.with(&[(key("K"), 0.0)]).is_ok(), "a damper alone holds the block");
        let fast = scene
            .with(&[(key("M"), 1e-6), (key("K"), 3e6), (key("B"), 0.0)])
            .expect("in range");
        let error = fast.validate_rate(1e-3).expect_err("1732 rad a tick");
        assert!(error.to_string().contains("raise mass"), "{error}");
        assert!(fast.validate_rate(1e-4).is_ok());
        // Also a scene without a block, which nothing makes too fast.
        let on_device = Scene {
            block: None,
            coupling: None,
            ..Scene::paper()
        };
        for (scene, period_s) in [
            (&fast, 0.0),
            (&on_device, f64::NAN),
            (&on_device, -1e-3),
            (&fast, f64::INFINITY),
        ] {
            let error = Renderer::new(scene, Scheme::Exact, period_s).expect_err("no time from tick to tick");
            assert!(matches!(error, SceneError::NoPeriod { .. }), "{error}");
        }
    }
}
