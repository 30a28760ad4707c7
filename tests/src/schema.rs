//! What is said on the control socket, held against the protocol's schema.

use jsonschema::Validator;
use serde_json::json;

/// What of the protocol is meant.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// A line of a client.
    Request,
    /// A line of the server.
    Server,
    /// What `ok` holds in the answer to an operation.
    Answer(&'a str),
}

/// Tells what is of the protocol from what is not.
///
/// # Panics
/// The schema is none, or lacks the part.
#[must_use]
pub fn validator(part: Part<'_>) -> Validator {
    let place = match part {
        Part::Request => "#/$defs/RequestLine".to_owned(),
        Part::Server => "#/$defs/ServerLine".to_owned(),
        Part::Answer(op) => format!("#/$defs/Answers/{op}"),
    };
    let mut schema = haptic_ipc::schema::protocol();
    let whole = schema.as_object_mut().expect("a schema is an object");
    whole.remove("oneOf");
    whole.insert("$ref".to_owned(), json!(place));
    jsonschema::validator_for(&schema).unwrap_or_else(|error| panic!("{place}: {error}"))
}
