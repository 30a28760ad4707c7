//! Schedules on the wire: changes of the scene that the real-time loop makes in ticks to come.

use crate::advice::Advice;
use crate::changes::Changes;
use crate::error::WireError;
use crate::fields::{Fields as _, fields};
use crate::journal::Peer;
use crate::object::{Field, FieldValue, Limits, Object};
use crate::refusal;
use crate::request::RAMP;
use crate::scene::SceneRef;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

/// Most changes that may wait for their tick, of all schedules together.
pub const MAX_SCHEDULED_CHANGES: usize = 256;

fields! {
    /// A change of a schedule.
    #[derive(Clone, Debug, PartialEq)]
    #[cfg_attr(feature = "schema", schemars(deny_unknown_fields))]
    pub struct ScheduledChange {
        /// First tick with it.
        at_tick: u64,
    } optional {
        /// Duration, ms; default 0.
        ramp_ms: Option<f64> where RAMP,
    } with {
        /// The change.
        change: SceneChange,
    }
}

fields! {
    /// What a change does to the scene.
    #[derive(Clone, Debug, PartialEq)]
    pub enum SceneChange {
        /// Parameters, as for `set`.
        Params "params"(Changes),
        /// A whole scene, as for `scene.load`.
        Scene "scene"(SceneRef),
    }
}

impl ScheduledChange {
    fn of(given: &FieldValue<'_>) -> Result<Self, WireError> {
        let change =
            Object::of(given).ok_or_else(|| given.is_not("an object with `at_tick`, and `params` or `scene`"))?;
        change.no_field_twice()?;
        change.no_field_but(given.name, &Self::names())?;
        Self::read(given.name, &change)
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
        if items.is_empty() || items.len() > MAX_SCHEDULED_CHANGES {
            let (count, range) = (items.len(), format!("from 1 to {MAX_SCHEDULED_CHANGES}"));
            let shown = format!("{count} changes");
            #[expect(clippy::cast_precision_loss, reason = "a line has room for some thousands")]
            let (value, max) = (count as f64, MAX_SCHEDULED_CHANGES as f64);
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

/// Answer to `schedule`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleReply {
    /// Its name.
    pub name: String,
    /// In order of their ticks.
    pub changes: Vec<AcceptedChange>,
    /// Whether it was a dry run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub dry_run: bool,
    /// Remarks on the scenes, each once.
    pub advice: Vec<Advice>,
}

/// A scheduled change, as the daemon has accepted it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AcceptedChange {
    /// First tick with it.
    pub at_tick: u64,
    /// Revision of its scene.
    pub revision: u64,
    /// The values set, by full name.
    pub applied: BTreeMap<String, f64>,
}

/// Answer to `schedule.cancel`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleCancelReply {
    /// Number of cancelled changes.
    pub cancelled: usize,
    /// Whether anything was cancelled.
    pub changed: bool,
}

/// The waiting changes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScheduleStatus {
    /// Their client.
    pub by: Peer,
    /// Names of the schedules, in order of their ticks.
    pub names: Vec<String>,
    /// Number of changes.
    pub waiting: usize,
    /// Tick of the first.
    pub next_tick: u64,
    /// Tick of the last.
    pub last_tick: u64,
}
