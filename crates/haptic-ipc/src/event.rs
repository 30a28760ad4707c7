//! What a subscriber hears without asking.

use crate::error::WireError;
use crate::journal::JournalEntry;
use crate::object::{Field, FieldValue, Limits};
use crate::replay::{SceneArrival, ServoSetup, ServoSnapshot};
use crate::sample::Sample;
use crate::status::RigState;
use crate::timing::Timing;
use crate::values::{word, words};
use haptic_core::Directional;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

/// What can be subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The rig's state and the active scene, at once and at every change.
    State,
    /// How well the loop keeps time, once a second.
    Timing,
    /// The ticks.
    Samples,
    /// Every change, by whom and when, from now on.
    Log,
    /// The servo's state: before the first tick of `samples`, after lost ones, and every ten seconds.
    Snapshot,
}

impl Field for Vec<Topic> {
    fn expected(_: &str, _: Option<Limits>) -> String {
        format!("a list of topics: {}", words::<Topic>().join(", "))
    }

    fn read(given: &FieldValue<'_>) -> Result<Self, WireError> {
        if let Some(topics) = given.json() {
            return Ok(topics);
        }
        let expected = Self::expected(given.name, None);
        let items: Vec<&RawValue> = serde_json::from_str(given.text).map_err(|_| given.is_not(&expected))?;
        for item in items {
            let Ok(topic) = serde_json::from_str::<String>(item.get()) else {
                break;
            };
            word(given, "topic", &topic, words::<Topic>())?;
        }
        Err(given.is_not(&expected))
    }
}

/// A line that answers no request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The whole state: at once after `subscribe`, and at every change.
    State(StateEvent),
    /// The servo's settings, when they change. Of the topic `state`.
    Servo(Box<ServoEvent>),
    /// Once a second.
    Timing(Box<Timing>),
    /// A batch of ticks.
    Samples(SamplesEvent),
    /// A change, with its author and time.
    Log(Box<JournalEntry>),
    /// The servo's state before a tick. Where every tick is subscribed to as well, the first one is that of
    /// the first snapshot.
    Snapshot(Box<SnapshotEvent>),
    /// A topic of a later server.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// The rig's state and the active scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateEvent {
    /// State of the rig.
    pub state: RigState,
    /// Why it is faulted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The tick of this state.
    pub tick: u64,
    /// Revision of the active scene.
    pub revision: u64,
    /// Name of the active scene.
    pub scene: String,
    /// Its friction law.
    #[serde(default)]
    pub law: String,
    /// Its parameters, or those that they ramp to.
    pub params: BTreeMap<String, Directional>,
    /// Changes that `undo` can undo.
    #[serde(default)]
    pub undo_depth: usize,
    /// Changes that `redo` can redo.
    #[serde(default)]
    pub redo_depth: usize,
    /// The whole scene, and how it took effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrival: Option<Box<SceneArrival>>,
}

/// The servo's settings from a tick on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ServoEvent {
    /// The first tick that is computed with them.
    pub tick: u64,
    /// The settings.
    pub servo: ServoSetup,
}

/// The servo's state before a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SnapshotEvent {
    /// The tick that goes on from it.
    pub tick: u64,
    /// The state.
    pub snapshot: ServoSnapshot,
}

/// A batch of ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SamplesEvent {
    /// Counts the sample events of the subscription, from 0.
    pub seq: u64,
    /// Rows lost since the previous event.
    pub dropped: u64,
    /// The ticks, oldest first.
    pub rows: Vec<Sample>,
}

/// Answer to `subscribe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SubscribeReply {
    /// The topics subscribed to.
    pub topics: Vec<Topic>,
    /// Samples a second: the rate asked for, or the nearest one that the loop's rate divides into.
    pub rate_hz: f64,
    /// Least time between sample events, ms.
    pub batch_ms: u32,
    /// Names of a row's columns.
    pub columns: Vec<String>,
    /// The servo's settings behind the rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
}
