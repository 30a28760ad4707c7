//! Schedules on the wire: changes of the scene that the real-time loop makes in ticks to come.

use crate::advice::Advice;
use crate::change_options::RAMP;
use crate::changes::Changes;
use crate::error::{ErrorCode, WireError};
use crate::journal::Peer;
use crate::object::{Field, FieldValue, Limits, Object};
use crate::refusal;
use crate::scene::SceneRef;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

/// Most changes that may wait for their tick, of all schedules together.
pub const MOST_SCHEDULED_CHANGES: usize = 256;

/// A change of a schedule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScheduledChange {
    /// The tick that is to render it first.
    pub at_tick: u64,
    /// The change.
    #[serde(flatten)]
    pub change: SceneChange,
    /// Time over which to change, ms; at once when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp_ms: Option<f64>,
}

/// What a change does to the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneChange {
    /// It changes parameters, as `set` does.
    Params(Changes),
    /// It loads a whole scene, as `scene.load` does.
    Scene(SceneRef),
}

impl ScheduledChange {
    const FIELDS: [&str; 4] = ["at_tick", "params", "scene", "ramp_ms"];

    fn of(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let change =
            Object::of(given).ok_or_else(|| given.is_not("an object with `at_tick`, and `params` or `scene`"))?;
        change.no_field_twice()?;
        change.no_field_but(given.name, &Self::FIELDS)?;
        let params: Option<Changes> = change.optional("params", None)?;
        let scene: Option<SceneRef> = change.optional("scene", None)?;
        let what = match (params, scene) {
            (Some(params), None) => SceneChange::Params(params),
            (None, Some(scene)) => SceneChange::Scene(scene),
            _ => {
                let message = format!("{} must have either `params` or `scene`", given.path());
                return Err(WireError::new(ErrorCode::BadRequest, message).about("params"));
            }
        };
        Ok(Self {
            at_tick: change.needed(given.name, "at_tick", None)?,
            change: what,
            ramp_ms: change.optional("ramp_ms", Some(RAMP))?,
        })
    }
}

impl Field for Vec<ScheduledChange> {
    fn expected(_: &str, _: Option<Limits>) -> String {
        r#"a list of changes, as in [{"at_tick":5000,"params":{"Fs":5}}]"#.to_owned()
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let items: Vec<&RawValue> = given
            .borrowed()
            .ok_or_else(|| given.is_not(&Self::expected(given.name, None)))?;
        if items.is_empty() || items.len() > MOST_SCHEDULED_CHANGES {
            let (count, range) = (items.len(), format!("from 1 to {MOST_SCHEDULED_CHANGES}"));
            let shown = format!("{count} changes");
            #[expect(clippy::cast_precision_loss, reason = "a line has room for some thousands")]
            let (value, max) = (count as f64, MOST_SCHEDULED_CHANGES as f64);
            return Err(refusal::out_of_range(given.name, given.name, &shown, "1", &range).within(value, 1.0, max, "1"));
        }
        let change = |(index, item): (usize, &RawValue)| {
            let name = format!("{}[{index}]", given.name);
            ScheduledChange::of(&FieldValue {
                object: "",
                name: &name,
                text: item.get(),
                limits: None,
            })
        };
        items.into_iter().enumerate().map(change).collect()
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for ScheduledChange {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ScheduledChange".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A change of a schedule: it has either `params` or `scene`.",
            "type": "object",
            "properties": {
                "at_tick": { "type": "integer", "minimum": 0, "description": "The tick that is to render it first." },
                "params": generator.subschema_for::<Changes>(),
                "scene": generator.subschema_for::<SceneRef>(),
                "ramp_ms": {
                    "type": ["number", "null"],
                    "minimum": RAMP.smallest(),
                    "maximum": RAMP.max,
                    "description": "Time over which to change, ms; at once when absent.",
                },
            },
            "required": ["at_tick"],
            "oneOf": [{ "required": ["params"] }, { "required": ["scene"] }],
            "additionalProperties": false,
        })
    }
}

/// Answer to `schedule`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleReply {
    /// Name of the schedule, for `schedule.cancel`.
    pub name: String,
    /// Its changes, in the order of their ticks.
    pub changes: Vec<AcceptedChange>,
    /// Whether it was a dry run: nothing is scheduled.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub dry_run: bool,
    /// Remarks on the scenes, and the bounds that they break, each once.
    pub advice: Vec<Advice>,
}

/// A scheduled change, as the daemon has accepted it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AcceptedChange {
    /// The tick that will render it first.
    pub at_tick: u64,
    /// The revision that its scene will have.
    pub revision: u64,
    /// The values that it will set, by full name.
    pub applied: BTreeMap<String, f64>,
}

/// Answer to `schedule.cancel`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleCancelReply {
    /// Number of changes that were taken back before their tick.
    pub cancelled: usize,
    /// Whether anything was taken back.
    pub changed: bool,
}

/// The changes that wait for their tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleStatus {
    /// The client that scheduled them.
    pub by: Peer,
    /// Names of the schedules, in the order of their ticks.
    pub names: Vec<String>,
    /// Number of changes that wait.
    pub waiting: usize,
    /// The tick of the first of them.
    pub next_tick: u64,
    /// The tick of the last of them.
    pub last_tick: u64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Envelope, Request};

    fn parsed(changes: &str) -> Result<Request, WireError> {
        let line = format!(r#"{{"id":1,"op":"schedule","changes":{changes}}}"#);
        Envelope::parse(&line)
            .map(|envelope| envelope.request)
            .map_err(|bad| bad.error)
    }

    #[test]
    fn a_schedule_is_read_as_it_is_written() {
        let changes =
            r#"[{"at_tick":100,"params":{"Fs":{"plus":0.5}}},{"at_tick":200,"scene":"lugre","ramp_ms":50.0}]"#;
        let request = parsed(changes).expect("it reads");
        let Request::Schedule { changes: read, .. } = &request else {
            panic!("{request:?}");
        };
        assert_eq!(serde_json::to_string(read).expect("JSON"), changes);
    }

    #[test]
    fn a_bad_change_is_refused_by_its_place() {
        for (changes, parts) in [
            ("[]", vec!["changes", "0 changes", "from 1 to 256"]),
            ("{}", vec!["changes", "a list of changes"]),
            ("[3]", vec!["changes[0]", "an object"]),
            (r#"[{"at_tick":1}]"#, vec!["changes[0]", "params", "scene"]),
            (r#"[{"at_tick":1,"params":{},"scene":1}]"#, vec!["changes[0]", "either"]),
            (r#"[{"params":{}}]"#, vec!["changes[0]", "at_tick"]),
            (r#"[{"at_tick":-1,"params":{}}]"#, vec!["changes[0].at_tick", "-1"]),
            (
                r#"[{"at_tick":1,"params":{}},{"at_tick":2,"params":{},"ramp_ms":20000}]"#,
                vec!["changes[1].ramp_ms", "20000", "10000 ms"],
            ),
            (r#"[{"at_tik":1,"params":{}}]"#, vec!["changes[0]", "at_tik", "at_tick"]),
        ] {
            let message = parsed(changes).expect_err(changes).message;
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
    }
}
