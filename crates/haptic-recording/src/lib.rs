//! Recordings: every tick of a rig in a file that other programs read too.
//!
//! A recording holds its [`Metadata`], a row for each [sample](haptic_ipc::Sample), and [`Mark`]s for
//! what happened, each before the first row that it concerns. It is a file in one of three
//! [`Format`]s, which hold the same: [`mcap`], [`csv`] and [`parquet`] specify them.
//!
//! The rows are what the daemon's servo was stepped with and what it gave. With the settings in the
//! metadata and the scenes in the marks a [`Servo`](haptic_core::servo::Servo) gives the same forces
//! again, to the last bit, where every tick is a row and the recording began without force.
//!
//! A recording that was broken off, by a full disk or a dead process, reads up to its last whole
//! entry, and [`Ending`] says so.
#![forbid(unsafe_code)]

mod columns;
mod copy;
pub mod csv;
mod cut;
mod error;
mod fields;
mod format;
mod gaps;
pub mod mcap;
pub mod parquet;
mod reader;
mod recorder;
mod state_marks;
mod sync;
mod thread;
mod writer;

pub use copy::{Repaired, collect, export, repair};
pub use cut::{Span, cut};
pub use error::{CopyError, CreateError, Ending, Place, RecordingError};
pub use format::{Format, UnknownFormat};
pub use reader::{Entry, Reader, Recording, open, read};
pub use recorder::{Recorder, create};
pub use state_marks::StateMarks;
pub use thread::{Kept, RecordingThread, WaitingParts};
pub use writer::{Totals, Writer};

use haptic_core::{Directional, Scene};
use haptic_ipc::{JournalEntry, RigState, SceneArrival, ServoSetup};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The version that is written here.
const VERSION: u32 = 1;

/// Under which circumstances a recording was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Name and version of the daemon.
    pub server: String,
    /// What the rig is.
    pub device: String,
    /// Nominal rate of the daemon's loop, Hz.
    pub loop_rate_hz: f64,
    /// Rows a second, Hz: the loop's rate, or less where samples were thinned.
    pub rate_hz: f64,
    /// Program that recorded, with its version, and the user who ran it; an earlier program did not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_by: Option<String>,
    /// When it began, in seconds since 1970 (UTC).
    pub started_unix_s: f64,
    /// Revision of the scene that was active when it began.
    pub revision: u64,
    /// That scene.
    pub scene: Scene,
    /// What the rows are computed with until a mark says otherwise; an earlier daemon did not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
    /// Notes of the person who made it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
    /// The daemon's whole answer to `status` when it began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<serde_json::Value>,
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

/// Something that happened between two rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "mark", rename_all = "snake_case")]
pub enum Mark {
    /// Another scene came into force.
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
        /// The whole scene, and how it came in; an earlier daemon did not tell.
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
    /// from it have marks of their own; an earlier recorder did not tell.
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
        /// Periods that the loop missed; an earlier daemon did not tell.
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
            | Self::Missed { tick, .. }
            | Self::Marker { tick, .. }
            | Self::Link { tick, .. } => Some(*tick),
            Self::Lost { .. } | Self::LostChanges { .. } | Self::End { .. } => None,
        }
    }

    /// Reads a mark from JSON; `None` for a mark of a later version.
    fn from_json(text: &[u8]) -> serde_json::Result<Option<Self>> {
        #[derive(Deserialize)]
        struct Kind {
            mark: Option<String>,
        }
        let kind: Kind = serde_json::from_slice(text)?;
        match kind.mark.as_deref() {
            Some(
                "scene" | "state" | "journal" | "servo" | "lost" | "lost_changes" | "missed" | "marker" | "link"
                | "end",
            ) => serde_json::from_slice(text).map(Some),
            _ => Ok(None),
        }
    }
}

/// The beginning of what stands in a file, for messages.
fn shown(text: &[u8]) -> String {
    const LONGEST: usize = 60;
    let text = String::from_utf8_lossy(text);
    let mut shown: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().count() > LONGEST {
        shown.push_str("...");
    }
    shown
}

#[cfg(test)]
mod tests;
