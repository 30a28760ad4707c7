//! What a subscriber hears without asking.

use crate::message::{RigState, Timing};
use crate::sample::Sample;
use haptic_core::Directional;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A line that answers no request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The whole state: at once after `subscribe`, and at every change.
    State(StateEvent),
    /// Once a second.
    Timing(Box<Timing>),
    /// A batch of ticks.
    Samples(SamplesEvent),
    /// A topic of a later server.
    #[serde(other)]
    Unknown,
}

/// The rig's state and the scene in force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Its parameters.
    pub params: BTreeMap<String, Directional>,
}

/// A batch of ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SamplesEvent {
    /// Counts the sample events of the subscription, from 0.
    pub seq: u64,
    /// Rows lost since the event before.
    pub dropped: u64,
    /// The ticks, oldest first.
    pub rows: Vec<Sample>,
}
