//! What happened between two rows, and which events of the daemon say so.

use haptic_core::Directional;
use haptic_ipc::{
    JournalEntry, RigState, Sample, SampleY, SceneArrival, ServoEvent, ServoSetup, ServoSnapshot, StateEvent,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Something that happened between two rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "mark", rename_all = "snake_case")]
pub enum Mark {
    /// The active scene changed.
    Scene {
        /// The first tick that rendered it, or began to ramp to it.
        tick: u64,
        /// Its revision.
        revision: u64,
        /// Its name.
        name: String,
        /// Its friction law.
        law: String,
        /// Its parameters by name, SI units; of a ramp, those that it ends at.
        params: BTreeMap<String, Directional>,
        /// The whole scene, and how it took effect; absent from an earlier daemon.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        arrival: Option<Box<SceneArrival>>,
    },
    /// The rig's state changed.
    State {
        /// The first tick in that state.
        tick: u64,
        /// The state.
        state: RigState,
        /// Why it is faulted.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        fault: Option<String>,
    },
    /// What a client or the daemon did, and who: an entry of the daemon's journal. The scene and the state that follow
    /// from it have marks of their own; an earlier recorder wrote none.
    Journal {
        /// The tick that carried it out.
        tick: u64,
        /// The entry.
        entry: Box<JournalEntry>,
    },
    /// The servo's settings changed: another device was plugged in, or more is known of the rig.
    Servo {
        /// The first tick that is computed with them.
        tick: u64,
        /// The settings.
        servo: Box<ServoSetup>,
    },
    /// The servo's state before a tick: a replay begins here. An earlier recorder wrote none.
    Snapshot {
        /// The tick that goes on from it.
        tick: u64,
        /// The state.
        snapshot: Box<ServoSnapshot>,
    },
    /// Rows are missing here.
    Lost {
        /// How many.
        rows: u64,
    },
    /// Changes of state, scene or settings, or markers, are missing here: the disk hung, and more of them waited than
    /// are kept. The newest state and settings follow.
    LostChanges {
        /// How many.
        changes: u64,
    },
    /// The loop missed periods: it came too late for their deadlines.
    Missed {
        /// The first tick after them.
        tick: u64,
        /// How many, since the row before.
        periods: u64,
    },
    /// A person marked this place.
    Marker {
        /// The tick.
        tick: u64,
        /// What the person calls it.
        text: String,
    },
    /// Something happened to the link to the rig or to the daemon.
    Link {
        /// The first tick after it.
        tick: u64,
        /// What happened.
        text: String,
    },
    /// The recording was ended on purpose; nothing follows.
    End {
        /// Rows that it holds.
        rows: u64,
        /// Rows that are missing from it.
        lost: u64,
        /// Periods that the loop missed; absent from an earlier daemon.
        #[serde(default)]
        missed: u64,
    },
}

impl Mark {
    /// The tick that it concerns, where there is one.
    #[must_use]
    pub const fn tick(&self) -> Option<u64> {
        match self {
            Self::Scene { tick, .. }
            | Self::State { tick, .. }
            | Self::Journal { tick, .. }
            | Self::Servo { tick, .. }
            | Self::Snapshot { tick, .. }
            | Self::Missed { tick, .. }
            | Self::Marker { tick, .. }
            | Self::Link { tick, .. } => Some(*tick),
            Self::Lost { .. } | Self::LostChanges { .. } | Self::End { .. } => None,
        }
    }

    /// Reads a mark from JSON; `None` for a mark of a later version.
    pub(crate) fn from_json(text: &[u8]) -> serde_json::Result<Option<Self>> {
        #[derive(Deserialize)]
        struct Kind {
            mark: Option<String>,
        }
        let kind: Kind = serde_json::from_slice(text)?;
        match kind.mark.as_deref() {
            Some(
                "scene" | "state" | "journal" | "servo" | "snapshot" | "lost" | "lost_changes" | "missed" | "marker"
                | "link" | "end",
            ) => serde_json::from_slice(text).map(Some),
            _ => Ok(None),
        }
    }
}

/// A row or a mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A sample, and what it has of a second axis.
    Row(Sample, Option<SampleY>),
    /// What happened before the next row.
    Mark(Mark),
}

/// Tells which changes an event of the topic `state` brings.
#[derive(Debug, Default)]
pub struct StateMarks {
    revision: Option<u64>,
    state: Option<RigState>,
}

impl StateMarks {
    /// Of events that come while a revision of the scene is active.
    pub fn after(revision: u64) -> Self {
        Self {
            revision: Some(revision),
            state: None,
        }
    }

    /// The changes since the event before: another scene, another state.
    pub fn of(&mut self, event: &StateEvent) -> impl Iterator<Item = Mark> + use<> {
        let is_new_scene = self.revision.replace(event.revision) != Some(event.revision);
        let scene = is_new_scene.then(|| Mark::Scene {
            tick: event.tick,
            revision: event.revision,
            name: event.scene.clone(),
            law: event.law.clone(),
            params: event.params.clone(),
            arrival: event.arrival.clone(),
        });
        let is_new_state = self.state.replace(event.state) != Some(event.state);
        let state = is_new_state.then(|| Mark::State {
            tick: event.tick,
            state: event.state,
            fault: event.fault.clone(),
        });
        scene.into_iter().chain(state)
    }
}

impl From<ServoEvent> for Mark {
    fn from(event: ServoEvent) -> Self {
        Self::Servo {
            tick: event.tick,
            servo: Box::new(event.servo),
        }
    }
}
