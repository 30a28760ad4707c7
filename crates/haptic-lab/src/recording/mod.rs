//! Recordings: every tick of a rig in a file that other programs read too.
//!
//! A recording is CSV with lines of `#`, so that pandas (`comment="#"`), R, Matlab and gnuplot read
//! it as it is:
//!
//! ```text
//! # hapticd recording 1
//! # {"server":"hapticd 0.1.0","device":"fake rig","loop_rate_hz":1000.0,"rate_hz":1000.0,"started_unix_s":1760000000.0,"revision":7,"scene":{...}}
//! tick,t_s,state,contact,device_position_m,...
//! 183042,183.042,engaged,0,0.0123,...
//! # {"mark":"scene","tick":183050,"revision":8,"name":"steel on teflon","law":"karnopp","params":{"mass":0.5,...}}
//! # {"mark":"state","tick":183100,"state":"stopped"}
//! # {"mark":"lost","rows":12}
//! # {"mark":"end","rows":5000,"lost":12}
//! ```
//!
//! The first line names the format and its version, the next lines hold the [`Metadata`], then come
//! the columns' names ([`haptic_ipc::SAMPLE_COLUMNS`], later versions may add more at the end) and
//! a row for each sample. A [`Mark`] stands before the first row that it concerns. Other lines of
//! `#` are remarks, and are passed over.
//!
//! The rows are what the daemon's servo was stepped with and what it gave. With the settings in the
//! metadata and the scenes in the marks a [`Servo`](haptic_core::servo::Servo) gives the same forces
//! again, to the last bit, where every tick is a row and the recording began without force.
//!
//! A line counts only when its newline is there. A recording that was broken off, by a full disk or
//! a dead process, reads up to its last whole line, and [`Ending`] says so.

mod reader;
mod recorder;
mod writer;

pub use reader::{Ending, Entry, Reader, Recording, RecordingError, read};
pub use recorder::{Recorder, Totals};
pub use writer::Writer;

use haptic_core::{Directional, Scene};
use haptic_ipc::{RigState, SceneArrival, ServoSetup};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the first line of every recording begins with; its version follows.
const TITLE: &str = "# hapticd recording ";

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
    /// When it began, in seconds since 1970 (UTC).
    pub started_unix_s: f64,
    /// Revision of the scene in force when it began.
    pub revision: u64,
    /// That scene.
    pub scene: Scene,
    /// What the rows are computed with; an earlier daemon did not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoSetup>,
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
    /// Rows are missing here.
    Lost {
        /// How many.
        rows: u64,
    },
    /// The recording was ended on purpose; nothing follows.
    End {
        /// Rows that it holds.
        rows: u64,
        /// Rows that are missing from it.
        lost: u64,
    },
}

impl Mark {
    /// The tick that it concerns, where there is one.
    #[must_use]
    pub const fn tick(&self) -> Option<u64> {
        match self {
            Self::Scene { tick, .. } | Self::State { tick, .. } => Some(*tick),
            Self::Lost { .. } | Self::End { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests;
