//! What the panel hears from the daemon, and about it.

use crate::intent::Intent;
use crate::recording::{Loaded, RecordingNews};
use haptic_ipc::{
    AdviceReply, ChangeReply, Description, Event, Hello, LogReply, SceneDiffReply, SceneListReply, SceneReply,
    SceneSaveReply, StateReply, Status, WireError,
};
use std::path::PathBuf;
use std::time::Duration;

/// One piece of news.
#[derive(Clone, Debug, PartialEq)]
pub enum Update {
    /// The first attempt to reach the daemon began.
    Connecting {
        /// The socket looked at.
        path: PathBuf,
    },
    /// The daemon greeted; everything known of an earlier one is void.
    Connected {
        /// Its socket.
        path: PathBuf,
        /// The greeting.
        hello: Hello,
    },
    /// There is no daemon to talk to; the next attempt follows by itself.
    Disconnected {
        /// The socket looked at.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The parameter table.
    Described(Description),
    /// What the adviser says of a scene. It is asked again whenever the scene changes.
    Advised(Result<AdviceReply, WireError>),
    /// The scene in force, whole. It is asked for again whenever it changes.
    Scene(Result<Box<SceneReply>, WireError>),
    /// The daemon's library of scenes.
    Library(Result<SceneListReply, WireError>),
    /// What was changed before the panel listened.
    Journal(Result<LogReply, WireError>),
    /// How rig and daemon are; asked for once a second.
    Status(Result<Box<Status>, WireError>),
    /// Something subscribed to.
    Event(Event),
    /// The daemon carried out what the user asked for, or refused.
    Answered {
        /// What was asked.
        intent: Intent,
        /// What came of it.
        result: Result<Answer, WireError>,
    },
    /// What becomes of the stop that was asked for last.
    Stop(StopNews),
    /// A file is being written or read.
    Busy(String),
    /// What became of an export: the file, or why there is none.
    Exported(Result<PathBuf, String>),
    /// What becomes of the recording that is being made.
    Recording(RecordingNews),
    /// A recording to look at, or why it cannot be.
    Opened {
        /// Its file.
        path: PathBuf,
        /// What is in it.
        result: Result<Box<Loaded>, String>,
    },
    /// A line that this program cannot read, as a later daemon may send.
    Unreadable {
        /// What is wrong with it.
        reason: String,
    },
}

/// What the daemon says to a request that it carried out.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To [`Intent::Set`], [`Intent::Load`], [`Intent::Undo`], [`Intent::Redo`] and [`Intent::TakeBack`].
    Changed(ChangeReply),
    /// To [`Intent::Engage`], [`Intent::Release`], [`Intent::Stop`] and [`Intent::Reset`].
    State(StateReply),
    /// To [`Intent::Save`].
    Saved(SceneSaveReply),
    /// To [`Intent::Compare`].
    Differs(SceneDiffReply),
}

/// What became of a stop.
#[derive(Clone, Debug, PartialEq)]
pub enum StopNews {
    /// The daemon's socket has it.
    Sent,
    /// It has not reached the daemon's socket. It is still tried.
    NotSent {
        /// Why.
        reason: String,
    },
    /// The daemon answered.
    Answered {
        /// Time from the press to the answer.
        after: Duration,
        /// Its answer.
        result: Result<StateReply, WireError>,
    },
}
