//! Changes of parameters, as `set` takes them.

use crate::error::{ErrorCode, WireError};
use crate::object::{Field, FieldValue, Limits, Object};
use crate::parameter;
use haptic_core::{Directional, ParameterKey};
use serde::{Serialize, Serializer};

/// Changes of parameters in the order given, by name or symbol. A name that is given twice is kept
/// twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(pub Vec<(String, Directional)>);

impl Changes {
    /// The changes by parameter.
    ///
    /// # Errors
    /// A name is not that of a parameter.
    pub fn resolve(&self) -> Result<Vec<(ParameterKey, f64)>, WireError> {
        let mut resolved = Vec::with_capacity(self.0.len());
        for (name, value) in &self.0 {
            let key: ParameterKey = name.parse()?;
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
            use haptic_core::Direction::{Negative, Positive};
            for direction in [Positive, Negative] {
                let one = ParameterKey {
                    parameter: key.parameter,
                    direction: Some(direction),
                };
                resolved.push((one, value.get(direction)));
            }
        }
        Ok(resolved)
    }
}

impl<N: Into<String>> FromIterator<(N, f64)> for Changes {
    fn from_iter<I: IntoIterator<Item = (N, f64)>>(changes: I) -> Self {
        Self(
            changes
                .into_iter()
                .map(|(name, value)| (name.into(), Directional::both(value)))
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
            // A parameter is told by its own name alone.
            let value = value.alone();
            Ok((value.name.to_owned(), parameter::read(&value, true)?))
        });
        changes.collect::<Result<_, _>>().map(Self)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Changes {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Changes".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "Parameters by name or symbol, as `describe` lists them, with `+` or `-` after it for one \
                            direction.",
            "type": "object",
            "additionalProperties": generator.subschema_for::<Directional>(),
        })
    }
}
