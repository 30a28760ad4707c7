//! What a subscriber hears without asking.

use crate::error::WireError;
use crate::journal::JournalEntry;
use crate::object::{Field, FieldValue, Limits};
use crate::replay::{SceneArrival, ServoSetup, ServoSnapshot};
use crate::sample::Sample;
use crate::sample_y::{SAMPLE_Y_COLUMNS, SampleRow, SampleY, one_axis};
use crate::status::RigState;
use crate::timing::Timing;
use crate::values::{word, words};
use haptic_core::Directional;
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

/// What can be subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The rig's state and the active scene.
    State,
    /// How well the loop keeps time.
    Timing,
    /// The ticks.
    Samples,
    /// New entries of the journal.
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
    /// A new entry.
    Log(Box<JournalEntry>),
    /// The servo's state before a tick. Where every tick is subscribed to, the first row is of the first snapshot's
    /// tick.
    Snapshot(Box<SnapshotEvent>),
    /// A topic of a later server.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

/// The rig's state and the active scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Its law.
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
    /// The first tick with them.
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
    /// The state, from which another servo goes on to the last bit.
    pub snapshot: ServoSnapshot,
}

/// A batch of ticks.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(try_from = "Batch")]
pub struct SamplesEvent {
    /// Counts the sample events of the subscription, from 0.
    pub seq: u64,
    /// Rows lost since the previous event.
    pub dropped: u64,
    /// The ticks, oldest first.
    pub rows: Vec<Sample>,
    /// What each of them has of a second axis; none on a rig of one.
    pub rows_y: Vec<SampleY>,
}

impl SamplesEvent {
    /// Each tick, oldest first, with what it has of a second axis.
    pub fn ticks(&self) -> impl Iterator<Item = (&Sample, Option<&SampleY>)> {
        self.rows
            .iter()
            .enumerate()
            .map(|(index, row)| (row, self.rows_y.get(index)))
    }

    /// Keeps the oldest `ticks`.
    pub fn truncate(&mut self, ticks: usize) {
        self.rows.truncate(ticks);
        self.rows_y.truncate(ticks);
    }
}

/// The same as it is sent: one row for a tick.
#[derive(Debug, Deserialize)]
#[cfg_attr(
    feature = "schema",
    derive(schemars::JsonSchema),
    schemars(rename = "SamplesEvent", description = "A batch of ticks.")
)]
struct Batch {
    /// Counts the sample events of the subscription, from 0.
    seq: u64,
    /// Rows lost since the previous event.
    dropped: u64,
    /// 2 if the rows have a second axis.
    #[serde(default = "one_axis", skip_serializing_if = "crate::sample_y::is_one_axis")]
    axes: u8,
    /// The ticks, oldest first.
    #[cfg_attr(feature = "schema", schemars(with = "Vec<Sample>"))]
    rows: Vec<SampleRow>,
}

impl TryFrom<Batch> for SamplesEvent {
    type Error = &'static str;

    fn try_from(batch: Batch) -> Result<Self, Self::Error> {
        let y = |row: &SampleRow| row.y.ok_or("a row of a rig of two axes has no number for the second");
        Ok(Self {
            seq: batch.seq,
            dropped: batch.dropped,
            rows_y: if batch.axes == 2 {
                batch.rows.iter().map(y).collect::<Result<_, _>>()?
            } else {
                Vec::new()
            },
            rows: batch.rows.into_iter().map(Sample::from).collect(),
        })
    }
}

impl Serialize for SamplesEvent {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let is_plane = !self.rows_y.is_empty();
        let mut batch = serializer.serialize_struct("SamplesEvent", 3 + usize::from(is_plane))?;
        batch.serialize_field("seq", &self.seq)?;
        batch.serialize_field("dropped", &self.dropped)?;
        if is_plane {
            batch.serialize_field("axes", &2)?;
        }
        batch.serialize_field("rows", &BatchRows(self))?;
        batch.end()
    }
}

/// The rows of a batch, written where they are.
struct BatchRows<'a>(&'a SamplesEvent);

impl Serialize for BatchRows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.ticks().map(|(sample, y)| SampleRow {
            sample: *sample,
            y: y.copied(),
        }))
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for SamplesEvent {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        Batch::schema_name()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Batch::json_schema(generator)
    }
}

/// Answer to `subscribe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SubscribeReply {
    /// The topics.
    pub topics: Vec<Topic>,
    /// Samples a second: as asked, or the nearest divisor of the loop's rate.
    pub rate_hz: f64,
    /// Least time between sample events, ms.
    pub batch_ms: u32,
    /// The columns.
    pub columns: Vec<String>,
    /// The servo's settings behind the rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
}

impl SubscribeReply {
    /// Axes of the rig: 2 where the rows have the columns of a second one, else 1.
    #[must_use]
    pub fn axes(&self) -> u8 {
        let has_y = self.columns.iter().any(|column| column == SAMPLE_Y_COLUMNS[0]);
        if has_y { 2 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::SAMPLE_COLUMNS;

    #[test]
    fn ticks_keep_their_second_axis() {
        let row = |tick| Sample {
            tick,
            ..Sample::default()
        };
        let y = |position| SampleY {
            device_position_m: position,
            ..SampleY::default()
        };
        let mut event = SamplesEvent {
            rows: vec![row(1), row(2), row(3)],
            rows_y: vec![y(0.1), y(0.2), y(0.3)],
            ..SamplesEvent::default()
        };
        let ticks: Vec<_> = event.ticks().collect();
        assert_eq!(ticks[1], (&row(2), Some(&y(0.2))));
        assert_eq!(
            ticks[1].1.and_then(|y| y.named().next()),
            Some(("device_position_y_m", 0.2))
        );
        event.truncate(1);
        assert_eq!((event.rows.len(), &event.rows_y), (1, &vec![y(0.1)]));
        event.rows_y.clear();
        assert_eq!(event.ticks().next(), Some((&row(1), None)));
    }

    #[test]
    fn row_of_two_axes_without_its_second_is_refused() {
        let event = SamplesEvent {
            rows: vec![Sample::default()],
            rows_y: vec![SampleY::default()],
            ..SamplesEvent::default()
        };
        let mut sent = serde_json::to_value(&event).expect("writes");
        assert_eq!(
            serde_json::from_value::<SamplesEvent>(sent.clone()).expect("reads"),
            event
        );
        sent["rows"][0].as_array_mut().expect("a row").pop();
        let error = serde_json::from_value::<SamplesEvent>(sent).expect_err("a cell is missing");
        assert!(error.to_string().contains("second"), "{error}");
    }

    #[test]
    fn columns_of_a_subscription_tell_the_axes() {
        let of = |columns: &[&str]| {
            let columns: Vec<String> = columns.iter().map(ToString::to_string).collect();
            let reply = serde_json::json!({"topics": [], "rate_hz": 1000.0, "batch_ms": 20, "columns": columns});
            serde_json::from_value::<SubscribeReply>(reply)
                .expect("an answer")
                .axes()
        };
        assert_eq!(of(SAMPLE_COLUMNS), 1);
        assert_eq!(of(&[SAMPLE_COLUMNS, &SAMPLE_Y_COLUMNS].concat()), 2);
    }
}
