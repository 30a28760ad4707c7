//! Metadata as texts by name: what MCAP and Parquet hold of them.

use crate::error::{Place, RecordingError};
use crate::format::VERSION;
use crate::metadata::Metadata;
use serde::Deserialize;
use serde_json::Value;

/// The field that holds the version of the recording.
pub(crate) const VERSION_FIELD: &str = "version";

/// Fields that are text; the others are JSON.
const TEXTS: [&str; 3] = ["server", "device", "notes"];

/// The version, and each field of the metadata.
///
/// # Errors
/// Never: metadata are finite numbers, texts and scenes.
pub(crate) fn to_fields(metadata: &Metadata) -> serde_json::Result<Vec<(String, String)>> {
    let mut fields = vec![(VERSION_FIELD.to_owned(), VERSION.to_string())];
    if let Value::Object(object) = serde_json::to_value(metadata)? {
        fields.extend(object.into_iter().map(|(name, value)| {
            let text = match value {
                Value::String(text) if TEXTS.contains(&name.as_str()) => text,
                value => value.to_string(),
            };
            (name, text)
        }));
    }
    Ok(fields)
}

/// Reads metadata; fields that a later version added are passed over.
///
/// # Errors
/// The recording is of another version, or a field is missing or damaged.
pub(crate) fn from_fields<'a>(
    place: Place,
    fields: impl IntoIterator<Item = (&'a str, &'a str)>,
) -> Result<Metadata, RecordingError> {
    let failed = |reason: String| RecordingError::Metadata { place, reason };
    let mut object = serde_json::Map::new();
    let mut version = None;
    for (name, text) in fields {
        let value = if name == VERSION_FIELD {
            version = Some(text.to_owned());
            continue;
        } else if TEXTS.contains(&name) {
            Value::String(text.to_owned())
        } else {
            serde_json::from_str(text).map_err(|error| failed(format!("{name}: {error}")))?
        };
        object.insert(name.to_owned(), value);
    }
    match version {
        None => return Err(failed(format!("there is no {VERSION_FIELD}"))),
        Some(found) if found != VERSION.to_string() => return Err(RecordingError::Version { found }),
        Some(_) => {}
    }
    Metadata::deserialize(Value::Object(object)).map_err(|error| failed(error.to_string()))
}
