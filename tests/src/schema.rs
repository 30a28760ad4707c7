//! Messages on the control socket, compared with the protocol's schema.

use serde_json::Value;

/// A part of the protocol.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// A line of a client.
    Request,
    /// A line of the server.
    Server,
    /// What `ok` holds in the answer to an operation.
    Answer(&'a str),
}

/// Tells whether a value belongs to a part of the protocol.
#[derive(Debug)]
pub struct Validator(#[cfg(feature = "jsonschema")] jsonschema::Validator);

impl Validator {
    /// Compiles a part of the schema. Without the feature `jsonschema` says that this is skipped.
    #[cfg(feature = "jsonschema")]
    pub fn of(part: Part<'_>) -> Option<Self> {
        let place = match part {
            Part::Request => "#/$defs/RequestLine".to_owned(),
            Part::Server => "#/$defs/ServerLine".to_owned(),
            Part::Answer(op) => format!("#/$defs/Answers/{op}"),
        };
        let mut schema = haptic_ipc::schema::protocol();
        let whole = schema.as_object_mut().expect("a schema is an object");
        whole.remove("oneOf");
        whole.insert("$ref".to_owned(), place.into());
        Self::of_schema(&schema)
    }

    /// Compiles a schema. Without the feature `jsonschema` says that this is skipped.
    #[cfg(feature = "jsonschema")]
    pub fn of_schema(schema: &Value) -> Option<Self> {
        let validator = jsonschema::validator_for(schema);
        Some(Self(validator.unwrap_or_else(|error| panic!("{error} in {schema}"))))
    }

    /// Says that the comparison with a part of the schema is skipped.
    #[cfg(not(feature = "jsonschema"))]
    pub fn of(_: Part<'_>) -> Option<Self> {
        Self::of_schema(&Value::Null)
    }

    /// Says that the comparison with a schema is skipped.
    #[cfg(not(feature = "jsonschema"))]
    pub fn of_schema(_: &Value) -> Option<Self> {
        test_run::skip("jsonschema", "cargo test -p system-tests --features jsonschema");
        None
    }

    /// Checks a value.
    ///
    /// # Errors
    /// It is not in the schema: why, and where.
    #[cfg(feature = "jsonschema")]
    pub fn check(&self, value: &Value) -> Result<(), String> {
        self.0
            .validate(value)
            .map_err(|error| format!("not in the schema: {error} at {}: {value}", error.instance_path()))
    }

    /// Without the feature `jsonschema` there is no validator that could be asked.
    ///
    /// # Errors
    /// None.
    #[cfg(not(feature = "jsonschema"))]
    pub fn check(&self, _: &Value) -> Result<(), String> {
        unreachable!("`of` makes no validator")
    }
}
