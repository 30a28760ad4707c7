//! What the user asked for: a block, its coupling to the hand, and the surface below it.

use crate::block::BlockState;
use crate::friction::{Directional, ElastoPlastic, Friction, Karnopp, Lugre, MOST_STICTION, SUDDEN_FALL_MPS, Slot};
use crate::parameters::{Direction, Parameter, ParameterInfo, ParameterKey, TABLE, known_names};
use alloc::string::String;
use alloc::vec::Vec;
use thiserror::Error;

/// The block that the hand drags.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Block {
    /// `M`, kg.
    #[cfg_attr(feature = "serde", serde(alias = "M"))]
    pub mass: f64,
}

/// The virtual coupling between device and block (Colgate, Stanley and Brown 1995).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Coupling {
    /// `K`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "K"))]
    pub stiffness: f64,
    /// `B`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "B"))]
    pub damping: f64,
}

impl Coupling {
    /// The force on a block, N: `K (p - x) + B (v - w)`.
    #[must_use]
    pub fn force(&self, state: &BlockState) -> f64 {
        self.stiffness * (state.device_position - state.position)
            + self.damping * (state.device_velocity - state.velocity)
    }
}

/// A scene: what the rig shall feel like. Its fields have the names of the TOML file.
///
/// A scene is plain data and may hold anything; [`Scene::validate`] says whether it can be rendered, and
/// [`Renderer::new`](crate::Renderer::new) takes no scene that cannot.
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
    pub friction: Friction,
}

/// Why a scene, or a change to one, is refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A value lies outside the accepted range.
    #[error("{param} = {value} {unit} is out of range: it must be from {min} to {max} {unit}")]
    OutOfRange {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// The value given.
        value: f64,
        /// The smallest value accepted.
        min: f64,
        /// The largest value accepted.
        max: f64,
        /// The unit of all three.
        unit: &'static str,
    },
    /// A value is not a finite number.
    #[error("{param} = {value} is not a finite number: it must be from {min} to {max} {unit}")]
    NotFinite {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// The value given.
        value: f64,
        /// The smallest value accepted.
        min: f64,
        /// The largest value accepted.
        max: f64,
        /// The unit of both.
        unit: &'static str,
    },
    /// No parameter has this name.
    #[error("there is no parameter `{name}`{} there are {}", suggestion(*.nearest), known_names())]
    UnknownParameter {
        /// The name given.
        name: String,
        /// The name that was probably meant.
        nearest: Option<&'static str>,
    },
    /// A direction was given to a parameter that has none.
    #[error("`{given}`: {} has one value for both directions", param.info().name)]
    NotDirectional {
        /// The parameter.
        param: Parameter,
        /// What was given.
        given: String,
    },
    /// One request gives the same value twice.
    #[error("{param} is given twice in one change")]
    GivenTwice {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
    },
    /// A parameter that the scene does not have.
    #[error("{param} does not apply here: {}; this scene has {}", reason.text(), names(has))]
    NotApplicable {
        /// The parameter, with its direction where one was meant.
        param: ParameterKey,
        /// Why it does not.
        reason: NotApplicable,
        /// Those that it has.
        has: Vec<Parameter>,
    },
    /// What a stuck spring is anchored to, where there is none.
    #[error(
        "reseat does not apply here: behind a block the law `karnopp` holds rigidly; it has a stuck spring on the device itself only"
    )]
    ReseatBehindBlock,
    /// A block without a coupling.
    #[error("a [block] needs a [coupling] to the device, with stiffness (N/m) and damping (N s/m)")]
    BlockWithoutCoupling,
    /// A coupling without a block.
    #[error("a [coupling] holds a [block], and this scene has none: without one, friction acts on the device itself")]
    CouplingWithoutBlock,
    /// The law forbids a static limit below the dynamic one.
    #[error(
        "{param} = {static_force} N is below the dynamic force of {dynamic_force} N, which the law `{law}` forbids: raise it to {dynamic_force} N or more"
    )]
    StaticBelowDynamic {
        /// The static limit, with its direction.
        param: ParameterKey,
        /// The law.
        law: &'static str,
        /// N.
        static_force: f64,
        /// N.
        dynamic_force: f64,
    },
    /// The law goes from the static to the dynamic limit over a velocity, and has none.
    #[error(
        "stribeck_velocity = {velocity} m/s is too small: the law `{law}` goes from the static to the dynamic force over it, so it must be \
         {SUDDEN_FALL_MPS} m/s or more, or the two forces equal"
    )]
    NoStribeckVelocity {
        /// The law.
        law: &'static str,
        /// m/s.
        velocity: f64,
    },
    /// The reset integrator's stiction is out of proportion.
    #[error(
        "{param} = {static_force} N is more than {MOST_STICTION} times the dynamic force of {dynamic_force} N: the law `reset-integrator` holds the one with a bristle of the length that \
         the other gives; lower it to {max} N"
    )]
    TooMuchStiction {
        /// The static limit, with its direction.
        param: ParameterKey,
        /// N.
        static_force: f64,
        /// N.
        dynamic_force: f64,
        /// The largest static limit accepted, N.
        max: f64,
    },
    /// Nothing holds the block to the device.
    #[error("stiffness = 0 N/m and damping = 0 N s/m: a block needs at least one of them above 0 to be held")]
    NoCoupling,
    /// The block would oscillate too fast for the rate at which it is rendered.
    #[error(
        "a block of {mass} kg on {stiffness} N/m turns {radians:.0} rad in one tick of {period_us:.1} us; the limit is {limit} rad: \
         raise mass to {mass_needed:.3e} kg, or lower stiffness (with that of the contact) to {stiffness_allowed:.3e} N/m"
    )]
    TooFast {
        /// Mass, kg.
        mass: f64,
        /// Stiffness, N/m.
        stiffness: f64,
        /// The tick, microseconds.
        period_us: f64,
        /// Phase that the free oscillation gains in a tick, rad.
        radians: f64,
        /// The limit, rad.
        limit: f64,
        /// A mass that is within it, kg.
        mass_needed: f64,
        /// A stiffness that is within it, N/m.
        stiffness_allowed: f64,
    },
}

/// Why a scene does not have a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotApplicable {
    /// It is one of the block or its coupling, and there is no block.
    NoBlock,
    /// The law does not have it.
    Law(&'static str),
    /// Behind a block the law's contact is rigid.
    RigidBehindBlock,
}

impl NotApplicable {
    fn text(self) -> String {
        match self {
            Self::NoBlock => String::from("there is no block, so friction acts on the device itself"),
            Self::Law(law) => alloc::format!("the law `{law}` does not have it"),
            Self::RigidBehindBlock => String::from(
                "behind a block the law `karnopp` holds rigidly; it has a stuck spring on the device itself only",
            ),
        }
    }
}

fn names(parameters: &[Parameter]) -> String {
    let names: Vec<String> = parameters
        .iter()
        .map(|parameter| {
            let info = parameter.info();
            alloc::format!("{} ({})", info.name, info.symbol)
        })
        .collect();
    names.join(", ")
}

fn suggestion(nearest: Option<&'static str>) -> String {
    nearest.map_or_else(|| String::from(";"), |name| alloc::format!(", did you mean `{name}`?"))
}

/// Largest `omega_d T` accepted, rad: the work of a tick is bounded by the half-turns in it.
pub const MAX_PHASE_PER_TICK_RAD: f64 = 400.0;

/// Something about a valid scene that its user may not expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    /// The parameter concerned, with its direction where only one is.
    pub param: ParameterKey,
    /// What happens, and from which value on.
    pub kind: NoteKind,
}

/// What a [`Note`] says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoteKind {
    /// The static limit lies below the dynamic one, which then decides when the block lets go.
    BreakawayAtDynamicForce {
        /// The static limit, N.
        static_force: f64,
        /// The dynamic limit, N: the force at which the block really lets go.
        dynamic_force: f64,
    },
}

impl core::fmt::Display for Note {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.kind {
            NoteKind::BreakawayAtDynamicForce {
                static_force,
                dynamic_force,
            } => write!(
                f,
                "{} = {static_force} N is below the dynamic force of {dynamic_force} N: the block lets go at {dynamic_force} N",
                self.param
            ),
        }
    }
}

impl Scene {
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

    /// Where a parameter is kept, if the scene has it.
    pub(crate) fn slot(&mut self, parameter: Parameter) -> Option<Slot<'_>> {
        let on_device = self.is_on_device();
        match parameter {
            Parameter::Mass => self.block.as_mut().map(|block| Slot::One(&mut block.mass)),
            Parameter::Stiffness => self.coupling.as_mut().map(|held| Slot::One(&mut held.stiffness)),
            Parameter::Damping => self.coupling.as_mut().map(|held| Slot::One(&mut held.damping)),
            _ => self.friction.slot(parameter, on_device),
        }
    }

    /// The value of a parameter, nothing where the scene does not have it. One that has no directions holds the same number in both.
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

    fn not_applicable(&self, param: ParameterKey) -> SceneError {
        let reason = match param.parameter {
            Parameter::Mass | Parameter::Stiffness | Parameter::Damping => NotApplicable::NoBlock,
            Parameter::ContactStiffness if matches!(self.friction, Friction::Karnopp(_)) => {
                NotApplicable::RigidBehindBlock
            }
            _ => NotApplicable::Law(self.friction.law()),
        };
        SceneError::NotApplicable {
            param,
            reason,
            has: self.parameters(),
        }
    }

    pub(crate) fn put(&mut self, key: ParameterKey, value: f64) -> Result<(), SceneError> {
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

    /// The scene with some parameters changed: all of them, or none when one is refused.
    ///
    /// # Errors
    /// The first reason why the changed scene cannot be rendered, or [`SceneError::GivenTwice`].
    pub fn with(&self, changes: &[(ParameterKey, f64)]) -> Result<Self, SceneError> {
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
            changed.put(key, value)?;
        }
        changed.validate()?;
        Ok(changed)
    }

    /// Whether the scene can be rendered.
    ///
    /// # Errors
    /// The first value that is not finite or out of range, or a missing coupling.
    pub fn validate(&self) -> Result<(), SceneError> {
        for row in &TABLE {
            let Some(value) = self.value(row.parameter) else {
                continue;
            };
            if value.is_symmetric() || !row.directional {
                check_range(row.parameter.into(), value.positive)?;
            } else {
                for direction in Direction::BOTH {
                    let key = ParameterKey {
                        parameter: row.parameter,
                        direction: Some(direction),
                    };
                    check_range(key, value.get(direction))?;
                }
            }
        }
        match (&self.block, &self.coupling) {
            (Some(_), None) => return Err(SceneError::BlockWithoutCoupling),
            (None, Some(_)) => return Err(SceneError::CouplingWithoutBlock),
            (Some(_), Some(held)) if held.stiffness == 0.0 && held.damping == 0.0 => {
                return Err(SceneError::NoCoupling);
            }
            _ => {}
        }
        self.validate_law()
    }

    /// What a law asks of its parameters beyond their ranges.
    fn validate_law(&self) -> Result<(), SceneError> {
        let law = self.friction.law();
        match &self.friction {
            Friction::Karnopp(karnopp) => {
                if self.block.is_some() && karnopp.contact_stiffness.is_some() {
                    return Err(self.not_applicable(Parameter::ContactStiffness.into()));
                }
                if self.block.is_some() && karnopp.reseat.is_some() {
                    return Err(SceneError::ReseatBehindBlock);
                }
            }
            Friction::ResetIntegrator(reset) => {
                static_not_below(law, reset.static_force, reset.dynamic_force)?;
                for direction in Direction::BOTH {
                    let (held, sliding) = (reset.static_force.get(direction), reset.dynamic_force.get(direction));
                    let max = MOST_STICTION * sliding;
                    if held > max {
                        return Err(SceneError::TooMuchStiction {
                            param: Parameter::StaticForce.in_direction(direction),
                            static_force: held,
                            dynamic_force: sliding,
                            max,
                        });
                    }
                }
            }
            Friction::Lugre(Lugre {
                static_force,
                dynamic_force,
                stribeck_velocity,
                ..
            })
            | Friction::ElastoPlastic(ElastoPlastic {
                static_force,
                dynamic_force,
                stribeck_velocity,
                ..
            }) => {
                static_not_below(law, *static_force, *dynamic_force)?;
                if static_force != dynamic_force && *stribeck_velocity < SUDDEN_FALL_MPS {
                    return Err(SceneError::NoStribeckVelocity {
                        law,
                        velocity: *stribeck_velocity,
                    });
                }
            }
            Friction::Dahl(_) | Friction::HaywardArmstrong(_) | Friction::SalcudeanVlaar(_) | Friction::Viscous(_) => {}
        }
        Ok(())
    }

    /// Whether the scene can be rendered with ticks of `period_s` seconds.
    ///
    /// # Errors
    /// [`SceneError::TooFast`] where the block oscillates more than [`MAX_PHASE_PER_TICK_RAD`] in a tick.
    pub fn validate_rate(&self, period_s: f64) -> Result<(), SceneError> {
        let (Some(block), Some(held)) = (&self.block, &self.coupling) else {
            return Ok(());
        };
        let contact_stiffness = self.friction.contact_stiffness(false);
        let (mass, stiffness) = (block.mass, held.stiffness + contact_stiffness);
        // A contact that gives way is damped by its own law at times only.
        let viscous = match self.value(Parameter::Viscous) {
            Some(viscous) if contact_stiffness == 0.0 => viscous.least(),
            _ => 0.0,
        };
        let sigma = (held.damping + viscous) / (2.0 * mass);
        let omega_d_squared = stiffness / mass - sigma * sigma;
        let radians = crate::math::sqrt(omega_d_squared.max(0.0)) * period_s;
        if radians <= MAX_PHASE_PER_TICK_RAD {
            return Ok(());
        }
        // Undamped, so that the advice holds whatever the damping.
        let omega_squared_allowed = (MAX_PHASE_PER_TICK_RAD / period_s) * (MAX_PHASE_PER_TICK_RAD / period_s);
        Err(SceneError::TooFast {
            mass,
            stiffness,
            period_us: period_s * 1e6,
            radians,
            limit: MAX_PHASE_PER_TICK_RAD,
            mass_needed: stiffness / omega_squared_allowed,
            stiffness_allowed: mass * omega_squared_allowed,
        })
    }

    /// What the user of this scene may not expect of it.
    #[must_use]
    pub fn notes(&self) -> Vec<Note> {
        let mut notes = Vec::new();
        let Friction::Karnopp(law) = &self.friction else {
            return notes;
        };
        if law.curve().is_some() {
            return notes;
        }
        for direction in Direction::BOTH {
            let (static_force, dynamic_force) = (law.static_force.get(direction), law.dynamic_force.get(direction));
            if static_force < dynamic_force {
                notes.push(Note {
                    param: ParameterKey {
                        parameter: Parameter::StaticForce,
                        direction: Some(direction),
                    },
                    kind: NoteKind::BreakawayAtDynamicForce {
                        static_force,
                        dynamic_force,
                    },
                });
            }
        }
        notes
    }
}

fn static_not_below(
    law: &'static str,
    static_force: Directional,
    dynamic_force: Directional,
) -> Result<(), SceneError> {
    for direction in Direction::BOTH {
        let (held, sliding) = (static_force.get(direction), dynamic_force.get(direction));
        if held < sliding {
            let same = static_force.is_symmetric() && dynamic_force.is_symmetric();
            return Err(SceneError::StaticBelowDynamic {
                param: if same {
                    Parameter::StaticForce.into()
                } else {
                    Parameter::StaticForce.in_direction(direction)
                },
                law,
                static_force: held,
                dynamic_force: sliding,
            });
        }
    }
    Ok(())
}

fn check_range(param: ParameterKey, value: f64) -> Result<(), SceneError> {
    let info = param.parameter.info();
    let (min, max, unit) = (info.min, info.max, info.unit);
    if !value.is_finite() {
        return Err(SceneError::NotFinite {
            param,
            value,
            min,
            max,
            unit,
        });
    }
    if value < min || value > max {
        return Err(SceneError::OutOfRange {
            param,
            value,
            min,
            max,
            unit,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
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
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_scene_file_reads_as_the_design_document_shows_it() {
        let text = r#"
            name = "simulated friction"
            [block]
            mass = 0.5
            [coupling]
            stiffness = 25000
            damping = 10
            [friction]
            law = "karnopp"
            static_force = { positive = 5.0, negative = 4 }
            dynamic_force = 3.5
        "#;
        let scene: Scene = toml::from_str(text).expect("a scene");
        assert_eq!(
            scene.value(Parameter::StaticForce).map(|limit| limit.negative),
            Some(4.0)
        );
        assert_eq!(scene.value(Parameter::Viscous), Some(Directional::both(0.0)));
        let again: Scene = toml::from_str(&toml::to_string(&scene).expect("writes")).expect("reads");
        assert_eq!(again, scene);
        let json = serde_json::to_string(&scene).expect("writes");
        assert_eq!(serde_json::from_str::<Scene>(&json).expect("reads"), scene);
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_scene_file_with_an_unknown_field_is_refused_by_its_name() {
        let mut value = serde_json::to_value(Scene::paper()).expect("writes");
        value["friction"]["colour"] = 1.into();
        let error = serde_json::from_value::<Scene>(value).expect_err("no such field");
        assert!(error.to_string().contains("colour"), "{error}");
    }
}
