//! What a subscriber hears without asking.

use crate::journal::JournalEntry;
use crate::request::Topic;
use crate::sample::Sample;
use crate::state::RigState;
use crate::timing::Timing;
use haptic_core::Directional;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A line that answers no request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The whole state: at once after `subscribe`, and at every change.
    State(StateEvent),
    /// Once a second.
    Timing(Box<Timing>),
    /// A batch of ticks.
    Samples(SamplesEvent),
    /// Something was changed, by whom and when.
    Log(Box<JournalEntry>),
    /// A topic of a later server.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// The rig's state and the scene in force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateEvent {
    /// State of the rig.
    pub state: RigState,
    /// Why it is faulted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The tick at which this was so.
    pub tick: u64,
    /// Revision of the scene in force.
    pub revision: u64,
    /// Name of the scene in force.
    pub scene: String,
    /// Its friction law.
    #[serde(default)]
    pub law: String,
    /// Its parameters; while they ramp, those that they ramp to.
    pub params: BTreeMap<String, Directional>,
    /// Changes that `undo` can take back.
    #[serde(default)]
    pub undo_depth: usize,
    /// Changes that `redo` can bring back.
    #[serde(default)]
    pub redo_depth: usize,
}

/// A batch of ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SamplesEvent {
    /// Counts the sample events of the subscription, from 0.
    pub seq: u64,
    /// Rows lost since the event before.
    pub dropped: u64,
    /// The ticks, oldest first.
    pub rows: Vec<Sample>,
}

/// Answer to `subscribe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SubscribeReply {
    /// What will be heard of.
    pub topics: Vec<Topic>,
    /// Samples a second: the rate asked for, or the nearest one that the loop's rate divides into.
    pub rate_hz: f64,
    /// Time between sample events, ms.
    pub batch_ms: u32,
    /// Names of a row's columns.
    pub columns: Vec<String>,
}
