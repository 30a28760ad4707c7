//! Scenes on the wire: which one is meant, what a change of them has done, and in what two differ.

use crate::advice::Advice;
use crate::error::{ErrorCode, WireError};
use crate::object::{Field, FieldValue, Limits, Object};
use crate::quantity::readable;
use crate::values::{is_whole, word, words};
use crate::{parameter, refusal};
use haptic_core::friction::{Friction, LAWS, Reseat};
use haptic_core::parameters::TABLE;
use haptic_core::scene::{Coupling, FileCoupling, SceneFile};
use haptic_core::{Directional, Scene};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// Which scene is meant: by its number, its name, or itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum SceneRef {
    /// By its revision.
    Revision(u64),
    /// By its name in the library.
    Name(String),
    /// This one.
    Scene(Box<SceneFile>),
}

impl From<Scene> for SceneRef {
    fn from(scene: Scene) -> Self {
        Self::Scene(Box::new(scene.into()))
    }
}

impl Field for SceneRef {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "a scene: the number of a revision, a name of the library in quotes, or the scene itself as an object"
            .to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        if let Some(name) = given.json() {
            return Ok(Self::Name(name));
        }
        if is_whole(given.text) {
            return u64::read(given).map(Self::Revision);
        }
        let Some(scene) = Object::of(given) else {
            return Err(given.is_not(&Self::expected(given.name, None)));
        };
        scene.no_field_twice()?;
        scene.no_field_but(given.name, &["name", "block", "coupling", "friction"])?;
        Ok(Self::Scene(Box::new(SceneFile {
            name: scene.optional("name", None)?,
            block: scene.optional::<Option<Part<_>>>("block", None)?.map(|part| part.0),
            coupling: scene.optional("coupling", None)?,
            friction: scene.needed::<Part<Friction>>(given.name, "friction", None)?.0,
        })))
    }
}

/// The block, the coupling or the friction of a scene. Which parameters it has is known to its
/// type.
struct Part<T>(T);

impl<T: DeserializeOwned> Field for Part<T> {
    fn expected(name: &str, _: Option<Limits>) -> String {
        match name {
            "friction" => "an object with the `law` and its parameters".to_owned(),
            _ => "an object of parameters and numbers".to_owned(),
        }
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let Some(part) = Object::of(given) else {
            return Err(given.is_not("an object of parameters and numbers"));
        };
        part.no_field_twice()?;
        for value in part.values() {
            let known = match value.name {
                "law" => &LAWS,
                "reseat" => words::<Reseat>(),
                name => {
                    if let Some(row) = TABLE.iter().find(|row| row.is_called(name)) {
                        parameter::read(&value, row.directional)?;
                    }
                    continue;
                }
            };
            let chosen: Option<String> = value.json();
            let chosen = chosen.ok_or_else(|| value.is_not(&format!("one of {}", known.join(", "))))?;
            word(&value, value.name, &chosen, known)?;
        }
        serde_json::from_str(given.text)
            .map(Self)
            .map_err(|error| refused_part(given, &error.to_string()))
    }
}

impl Field for FileCoupling {
    fn expected(_: &str, _: Option<Limits>) -> String {
        "an object with `stiffness` and `damping`, or the word \"rig\" in quotes".to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        match given.json::<String>() {
            Some(word) if word == "rig" => Ok(Self::Rig),
            None if Object::of(given).is_some() => Part::<Coupling>::read(given).map(|part| Self::Own(part.0)),
            _ => Err(given.is_not(&Self::expected(given.name, None))),
        }
    }
}

/// Why serde refused a part of a scene. Its message is the only place where it names the culprit.
fn refused_part(given: &FieldValue<'_>, message: &str) -> WireError {
    let path = given.path();
    let mut quoted = message.split('`').skip(1).step_by(2);
    match quoted.next() {
        Some(field) if message.starts_with("unknown field") => {
            refusal::unknown_field(&path, field, &quoted.collect::<Vec<_>>())
        }
        Some(field) if message.starts_with("missing field") => {
            let expected = match TABLE.iter().find(|row| row.is_called(field)) {
                Some(row) => parameter::expected(row.unit, row.directional),
                None => format!("one of {}", LAWS.join(", ")),
            };
            refusal::missing(&format!("`{path}`"), field, &expected)
        }
        _ => WireError::new(ErrorCode::BadRequest, format!("{path}: {message}")).about(given.name),
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for SceneRef {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SceneRef".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Which scene is meant.",
            "oneOf": [
                { "type": "integer", "minimum": 0, "description": "By its revision." },
                { "type": "string", "description": "By its name in the library." },
                generator.subschema_for::<SceneFile>(),
            ],
        })
    }
}

/// Answer to `get`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneReply {
    /// Revision of the newest scene.
    pub revision: u64,
    /// Its parameters, by name.
    pub params: BTreeMap<String, Directional>,
    /// The scene.
    pub scene: Scene,
}

/// The parameters of a scene by name.
#[must_use]
pub fn params_of(scene: &Scene) -> BTreeMap<String, Directional> {
    TABLE
        .iter()
        .filter_map(|row| Some((row.name.to_owned(), scene.value(row.parameter)?)))
        .collect()
}

/// Answer to `set`, `scene.load`, `undo` and `redo`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChangeReply {
    /// Its revision; without a change the newest one.
    pub revision: u64,
    /// False after a no-op or a dry run.
    #[serde(default = "assumed")]
    pub changed: bool,
    /// First tick with it or its ramp; absent without a change and with `at_tick`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tick: Option<u64>,
    /// The requested tick.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_tick: Option<u64>,
    /// The tick at which the ramp ends, if none is missed. The force follows within 50 ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp_ends_tick: Option<u64>,
    /// Whether it was a dry run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub dry_run: bool,
    /// The values set, by full name.
    pub applied: BTreeMap<String, f64>,
    /// Differences from the previous scene.
    #[serde(default)]
    pub changes: Vec<Difference>,
    /// Remarks on the changed scene.
    pub advice: Vec<Advice>,
}

/// Whether a change of an earlier server, which does not say so, has changed the scene.
const fn assumed() -> bool {
    true
}

/// A difference of two scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Difference {
    /// A parameter, `name`, `law` or `reseat`.
    pub param: String,
    /// The unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Absent if the scene did not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<Value>,
    /// Absent if the scene does not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<Value>,
}

/// A number, or a word.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Value {
    /// The value of a parameter, SI units.
    Number(Directional),
    /// Another value.
    Word(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) if value.is_symmetric() => f.write_str(&readable(value.positive)),
            Self::Number(value) => write!(f, "+{} -{}", readable(value.positive), readable(value.negative)),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: &Option<Value>| match (value, &self.unit) {
            (None, _) => "none".to_owned(),
            (Some(value), Some(unit)) if unit != "1" => format!("{value} {unit}"),
            (Some(value), _) => value.to_string(),
        };
        write!(f, "{}: {} -> {}", self.param, shown(&self.before), shown(&self.after))
    }
}

/// The differences of two scenes: name and law, then the parameters in the order of the table, then
/// `reseat`.
#[must_use]
pub fn differences(before: &Scene, after: &Scene) -> Vec<Difference> {
    let mut found = Vec::new();
    let mut compare = |param: &str, unit: Option<&str>, before: Option<Value>, after: Option<Value>| {
        if before != after {
            found.push(Difference {
                param: param.to_owned(),
                unit: unit.map(str::to_owned),
                before,
                after,
            });
        }
    };
    let word = |text: &str| Some(Value::Word(text.to_owned()));
    compare("name", None, word(&before.name), word(&after.name));
    compare("law", None, word(before.friction.law()), word(after.friction.law()));
    for row in &TABLE {
        let value = |scene: &Scene| scene.value(row.parameter).map(Value::Number);
        compare(row.name, Some(row.unit), value(before), value(after));
    }
    let reseat = |scene: &Scene| {
        let friction = serde_json::to_value(scene.friction).ok()?;
        Some(Value::Word(friction.get("reseat")?.as_str()?.to_owned()))
    };
    compare("reseat", None, reseat(before), reseat(after));
    found
}

/// Answer to `scene.list`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneListReply {
    /// The library, by name.
    pub scenes: Vec<ListedScene>,
}

/// A scene in the library.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ListedScene {
    /// Its name, for `scene.load`.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Its law.
    pub law: String,
    /// Its file; absent for a built-in scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// Why it cannot be loaded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Answer to `scene.save`, `scene.rename` and `scene.delete`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneSaveReply {
    /// Its name in the library, or the deleted name.
    pub name: String,
    /// Its file, or the deleted file.
    pub path: String,
}

/// Answer to `scene.diff`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SceneDiffReply {
    /// Empty for equal scenes.
    pub differences: Vec<Difference>,
}

/// The files of the folder `scenes` by their names.
macro_rules! scenes {
    ($($name:literal)+) => {
        &[$(($name, include_str!(concat!("../../../scenes/", $name, ".toml"))),)+]
    };
}

/// The scenes that every library has: names, and the TOML of each.
pub const BUILT_IN_SCENES: &[(&str, &str)] = scenes! {
    "simulated-friction"
    "no-friction"
    "high-stiction"
    "viscous-drag"
    "aluminium-on-teflon"
    "stuck-spring-on-the-device"
    "asymmetric-with-memory"
    "lugre"
    "light-block"
};
