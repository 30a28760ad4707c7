//! Changes of parameters, as `set` takes them.

use crate::error::{ErrorCode, WireError};
use crate::object::{Field, FieldValue, Limits, Object};
use crate::{parameter, refusal};
use haptic_core::{Direction, Directional, ParameterKey, Scene};
use serde::{Serialize, Serializer};

/// Changes of parameters in the order given, by name or symbol. A name that is given twice is kept
/// twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(pub Vec<(String, ParameterChange)>);

/// The change of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum ParameterChange {
    /// The new value, in the parameter's unit.
    To(Directional),
    /// A change of the scene's value; of two values both change.
    By(RelativeChange),
}

/// A change of the scene's value; of two values both change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(deny_unknown_fields))]
#[serde(rename_all = "snake_case")]
pub enum RelativeChange {
    /// The value times this factor.
    Times(f64),
    /// The value plus this number, in the parameter's unit.
    Plus(f64),
}

impl RelativeChange {
    /// The changed value.
    #[must_use]
    pub fn of(self, value: f64) -> f64 {
        match self {
            Self::Times(factor) => value * factor,
            Self::Plus(summand) => value + summand,
        }
    }
}

impl From<Directional> for ParameterChange {
    fn from(value: Directional) -> Self {
        Self::To(value)
    }
}

impl From<f64> for ParameterChange {
    fn from(value: f64) -> Self {
        Self::To(Directional::both(value))
    }
}

impl From<RelativeChange> for ParameterChange {
    fn from(change: RelativeChange) -> Self {
        Self::By(change)
    }
}

impl Changes {
    /// The new values by parameter, as changes of a scene.
    ///
    /// # Errors
    /// A name is not that of a parameter, or a pair is given to a parameter with one value.
    pub fn resolve(&self, scene: &Scene) -> Result<Vec<(ParameterKey, f64)>, WireError> {
        let mut resolved = Vec::with_capacity(self.0.len());
        for (name, change) in &self.0 {
            let key: ParameterKey = name.parse()?;
            let value = match change {
                ParameterChange::To(value) => *value,
                ParameterChange::By(change) => changed(scene, key, *change),
            };
            if value.is_symmetric() {
                resolved.push((key, value.positive));
                continue;
            }
            if key.direction.is_some() || !key.parameter.info().directional {
                return Err(WireError::new(
                    ErrorCode::NotDirectional,
                    format!("`{name}` takes one number, not a pair of directions"),
                )
                .about(name));
            }
            for direction in Direction::BOTH {
                resolved.push((key.parameter.in_direction(direction), value.get(direction)));
            }
        }
        Ok(resolved)
    }
}

/// The value of a parameter of a scene after a relative change.
fn changed(scene: &Scene, key: ParameterKey, change: RelativeChange) -> Directional {
    match (scene.value(key.parameter), key.direction) {
        (Some(value), Some(direction)) => Directional::both(change.of(value.get(direction))),
        (Some(value), None) => Directional::new(change.of(value.positive), change.of(value.negative)),
        // The scene refuses it, because it does not have the parameter.
        (None, _) => Directional::both(key.parameter.info().min),
    }
}

impl<N: Into<String>, V: Into<ParameterChange>> FromIterator<(N, V)> for Changes {
    fn from_iter<I: IntoIterator<Item = (N, V)>>(changes: I) -> Self {
        Self(
            changes
                .into_iter()
                .map(|(name, value)| (name.into(), value.into()))
                .collect(),
        )
    }
}

impl Serialize for Changes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl Field for Changes {
    fn expected(_: &str, _: Option<Limits>) -> String {
        r#"an object of parameters and numbers, as in {"mass":1.5}"#.to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let params = Object::of(given).ok_or_else(|| given.is_not(&Self::expected(given.name, None)))?;
        let changes = params.values().map(|value| {
            // A parameter is recognised by its own name alone.
            let value = value.alone();
            Ok((value.name.to_owned(), read_change(&value)?))
        });
        changes.collect::<Result<_, _>>().map(Self)
    }
}

/// Reads the change of the parameter that the field is named after: its new value, or by how much it
/// changes.
///
/// # Errors
/// There is no such parameter, its value is of the wrong type, or the object has not exactly one of `times` and
/// `plus`, with a number.
fn read_change(given: &FieldValue<'_>) -> Result<ParameterChange, WireError> {
    let Some(object) = Object::of(given) else {
        return parameter::read(given, true).map(ParameterChange::To);
    };
    let info = given.name.parse::<ParameterKey>()?.parameter.info();
    if !object.values().any(|field| ["times", "plus"].contains(&field.name)) {
        let known: &[&str] = if info.directional {
            &["times", "plus", "positive", "negative"]
        } else {
            &["times", "plus"]
        };
        let unknown = object
            .values()
            .map(|field| field.name)
            .find(|name| !known.contains(name));
        return match unknown {
            Some(name) => Err(refusal::unknown_field(given.name, name, known)),
            None => parameter::read(given, true).map(ParameterChange::To),
        };
    }
    let mut fields = object.values();
    let change = match (fields.next(), fields.next()) {
        (Some(field), None) => field.json::<f64>().and_then(|number| match field.name {
            "times" => Some(RelativeChange::Times(number)),
            "plus" => Some(RelativeChange::Plus(number)),
            _ => None,
        }),
        _ => None,
    };
    let expected = r#"a relative change, as in {"times":2} or {"plus":0.5}"#;
    change.map(ParameterChange::By).ok_or_else(|| given.is_not(expected))
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Changes {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Changes".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Parameters by name or symbol, with `+` or `-` for one direction.",
            "type": "object",
            "additionalProperties": generator.subschema_for::<ParameterChange>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_change_starts_from_scene_value_per_direction() {
        let two_sided = Scene::paper()
            .with(&[("Fs+".parse().expect("a key"), 5.0)])
            .expect("a valid scene");
        let changes: Changes = [
            ("mass", RelativeChange::Times(2.0)),
            ("Fs", RelativeChange::Plus(0.5)),
            ("Fd-", RelativeChange::Times(0.5)),
        ]
        .into_iter()
        .collect();
        let scene = two_sided
            .with(&changes.resolve(&two_sided).expect("known names"))
            .expect("a valid scene");
        let value = |name: &str| {
            scene
                .value(name.parse::<ParameterKey>().expect("a key").parameter)
                .expect("it has it")
        };
        assert_eq!(value("mass"), Directional::both(1.0));
        assert_eq!((value("Fs").positive, value("Fs").negative), (5.5, 4.5));
        assert_eq!((value("Fd").positive, value("Fd").negative), (3.5, 1.75));
        let missing: Changes = [("sigma0", RelativeChange::Times(2.0))].into_iter().collect();
        let refused = missing
            .resolve(&two_sided)
            .and_then(|changes| two_sided.with(&changes).map_err(WireError::from));
        assert_eq!(refused.map_err(|error| error.code), Err(ErrorCode::NotApplicable));
    }
}
