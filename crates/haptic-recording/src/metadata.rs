//! Under which circumstances a recording was made, and the same as texts by name: what MCAP and Parquet hold of them.

use crate::error::{Place, RecordingError};
use crate::format;
use haptic_core::Scene;
use haptic_ipc::ServoSetup;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Under which circumstances a recording was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Name and version of the daemon.
    pub server: String,
    /// What the rig is.
    pub device: String,
    /// Axes of the rig, 1 or 2; the version of the recording says it.
    #[serde(skip, default = "one")]
    pub axes: u8,
    /// Nominal rate of the daemon's loop, Hz.
    pub loop_rate_hz: f64,
    /// Rows a second, Hz: the loop's rate, or less where samples were thinned.
    pub rate_hz: f64,
    /// Program that recorded, with its version, and the user who ran it; absent from an earlier program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_by: Option<String>,
    /// When it began, in seconds since 1970 (UTC).
    pub started_unix_s: f64,
    /// Revision of the scene that was active when it began.
    pub revision: u64,
    /// That scene.
    pub scene: Scene,
    /// What the rows are computed with until a mark says otherwise; absent from an earlier daemon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
    /// Notes of the person who made it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
    /// The daemon's whole answer to `status` when it began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<Value>,
}

const fn one() -> u8 {
    1
}

/// Who records: a program, with its version, and the user who runs it.
#[must_use]
pub fn recorded_by(program: &str) -> String {
    let user = ["USER", "LOGNAME"]
        .into_iter()
        .find_map(|name| std::env::var(name).ok());
    match user.filter(|user| !user.is_empty()) {
        Some(user) => format!("{program}, {user}"),
        None => program.to_owned(),
    }
}

/// The field that holds the version of the recording.
pub(crate) const VERSION_FIELD: &str = "version";

/// Fields that are text; the others are JSON.
const TEXTS: [&str; 3] = ["server", "device", "notes"];

/// The version, and each field of the metadata.
///
/// # Errors
/// Never: metadata are finite numbers, texts and scenes.
pub(crate) fn to_fields(metadata: &Metadata) -> serde_json::Result<Vec<(String, String)>> {
    let mut fields = vec![(VERSION_FIELD.to_owned(), format::version(metadata.axes).to_string())];
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
    let failed = |reason: String| RecordingError::metadata(place, reason);
    let mut object = serde_json::Map::new();
    let mut version = None;
    for (name, text) in fields {
        let value = if name == VERSION_FIELD {
            version = Some(text);
            continue;
        } else if TEXTS.contains(&name) {
            Value::String(text.to_owned())
        } else {
            serde_json::from_str(text).map_err(|error| failed(format!("{name}: {error}")))?
        };
        object.insert(name.to_owned(), value);
    }
    let version = version.ok_or_else(|| failed(format!("there is no {VERSION_FIELD}")))?;
    let axes = format::axes(version)?;
    let metadata = Metadata::deserialize(Value::Object(object)).map_err(|error| failed(error.to_string()))?;
    Ok(Metadata { axes, ..metadata })
}
