//! Updates: what the daemon sends, and news of connection, files and stops.

use crate::identify::{Found, Headings};
use crate::intent::{DialogPurpose, Intent};
use crate::record::{Listed, Loaded, RecordingNews, WhatIfTape};
use crate::study::StudyNews;
use haptic_ipc::socket_path::NamedSocket;
use haptic_ipc::{
    AdviceReply, ChangeReply, DaemonMirror, Description, Event, Hello, LeaseReply, LogReply, MirrorChange,
    SceneDiffReply, SceneListReply, SceneReply, SceneSaveReply, StateReply, Status, SubscribeReply, WireError,
};
use std::path::PathBuf;
use std::time::Duration;

/// One update.
#[derive(Clone, Debug, PartialEq)]
pub enum Update {
    /// The first attempt to connect began.
    Connecting {
        /// The socket.
        path: PathBuf,
    },
    /// The daemon has greeted; all facts of an earlier connection are void.
    Connected {
        /// Its socket.
        path: PathBuf,
        /// The greeting.
        hello: Hello,
        /// The options with which haptic-ctl finds it; `None` where it needs none.
        ctl_options: Option<String>,
    },
    /// There is no connection; the next attempt follows by itself.
    Disconnected {
        /// The socket.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// There is no connection, and these other rigs have sockets on this machine.
    Rigs(Vec<NamedSocket>),
    /// What will be sent, and what the samples are computed with.
    Subscribed(Box<SubscribeReply>),
    /// The parameter table.
    Described(Description),
    /// The advice on a scene. It is requested again whenever the scene changes.
    Advised(Result<AdviceReply, WireError>),
    /// The whole active scene. It is requested again whenever it changes.
    Scene(Result<Box<SceneReply>, WireError>),
    /// The daemon's library of scenes.
    Library(Result<SceneListReply, WireError>),
    /// The changes before the panel listened.
    Journal(Result<LogReply, WireError>),
    /// The state of rig and daemon; requested once a second.
    Status(Result<Box<Status>, WireError>),
    /// The time for which the daemon has sent no sample, reported again and again; zero when samples come again.
    NoSample(Duration),
    /// An event of a subscribed topic.
    Event(Event),
    /// The daemon has carried out an intent, or refused it.
    Answered {
        /// The intent.
        intent: Intent,
        /// The outcome.
        result: Result<Answer, WireError>,
    },
    /// The progress of the newest stop.
    Stop(StopNews),
    /// The settings were kept, or why not.
    Remembered(Result<(), String>),
    /// A file is being written, or a scene rendered.
    Busy(String),
    /// A recording is being read.
    Reading {
        /// Its file.
        path: PathBuf,
        /// The share that is read, from 0 to 1, if it is known.
        share: Option<f64>,
    },
    /// A dialog of the desktop was closed: what was chosen, if anything was, or why there is no such dialog.
    DialogClosed(Result<Option<(DialogPurpose, PathBuf)>, String>),
    /// The outcome of an export: the file, or why there is none.
    Exported(Result<PathBuf, String>),
    /// The progress of the recording that is being written.
    Recording(RecordingNews),
    /// An opened recording, or why it cannot be opened.
    Opened {
        /// Its file.
        path: PathBuf,
        /// Its content.
        result: Result<Box<Loaded>, String>,
    },
    /// A recording of a folder.
    Listed {
        /// The folder.
        folder: PathBuf,
        /// The recording.
        listed: Box<Listed>,
    },
    /// The recordings of a folder are all listed, or why they cannot be.
    ListRead {
        /// The folder.
        folder: PathBuf,
        /// The outcome.
        result: Result<(), String>,
    },
    /// What would have been felt along the opened recording.
    WhatIf {
        /// Number of the question.
        number: u64,
        /// Its answer, or why there is none.
        result: Result<Box<WhatIfTape>, String>,
    },
    /// The columns of a file of text; `None` for a recording, whose columns are known.
    Headings {
        /// The file.
        path: PathBuf,
        /// Their names, or why they cannot be read.
        result: Headings,
    },
    /// How far an identification is.
    Identifying {
        /// Number of the question.
        number: u64,
        /// Share that is done, from 0 to 1.
        share: f64,
    },
    /// What was identified.
    Identified {
        /// Number of the question.
        number: u64,
        /// Its answer, or why there is none.
        result: Result<Box<Found>, String>,
    },
    /// News of the study with a person.
    Study(StudyNews),
    /// A line that this program cannot read; a later daemon may send some.
    Unreadable {
        /// Why not.
        reason: String,
    },
}

impl Update {
    /// Tells a mirror of the daemon what this says of it. Returns what that changes.
    pub(crate) fn tell(&self, mirror: &mut DaemonMirror) -> MirrorChange {
        match self {
            Self::Connected { hello, .. } => mirror.connect(&hello.server),
            Self::Disconnected { .. } => mirror.disconnect(),
            Self::Subscribed(reply) => mirror.take_subscription(reply),
            Self::Described(description) => return mirror.take_description(description.clone()),
            Self::Scene(Ok(reply)) => mirror.take_scene((**reply).clone()),
            // A daemon without a library or a journal refuses.
            Self::Library(result) => {
                mirror.library = result
                    .as_ref()
                    .map_or_else(|_| Vec::new(), |reply| reply.scenes.clone());
            }
            Self::Journal(Ok(reply)) => mirror.take_journal(reply.entries.clone()),
            Self::Status(Ok(status)) => mirror.status = Some(status.clone()),
            Self::Event(event) => return mirror.take_event(event),
            Self::Answered { result, .. } => match result {
                Ok(Answer::Changed(reply)) => return mirror.take_change(reply),
                Ok(Answer::State(reply)) => return mirror.take_state(reply),
                _ => {}
            },
            _ => {}
        }
        MirrorChange::default()
    }

    /// Whether it is one of a stream that never ends while there is a daemon: samples, timing and status.
    pub(crate) fn is_steady(&self) -> bool {
        matches!(
            self,
            Self::Event(Event::Samples(_) | Event::Timing(_)) | Self::Status(Ok(_))
        )
    }
}

/// The answer to a request that the daemon has carried out.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To [`Intent::Set`], [`Intent::Load`], [`Intent::Try`], [`Intent::TrialScene`], [`Intent::Foresee`],
    /// [`Intent::Undo`], [`Intent::Redo`] and [`Intent::TakeBack`].
    Changed(ChangeReply),
    /// To [`Intent::Engage`], [`Intent::Release`], [`Intent::Reset`] and [`Intent::SameRig`].
    State(StateReply),
    /// To [`Intent::Lease`].
    Leased(LeaseReply),
    /// To [`Intent::Save`].
    Saved(SceneSaveReply),
    /// To [`Intent::Compare`].
    Differs(SceneDiffReply),
    /// To [`Intent::WhatIfSaved`].
    Scene(Box<SceneReply>),
}

/// The progress of a stop.
#[derive(Clone, Debug, PartialEq)]
pub enum StopNews {
    /// The daemon's socket has it.
    Sent,
    /// It has not reached the daemon's socket. Attempts continue.
    NotSent {
        /// Why.
        reason: String,
    },
    /// It waited for a daemon, and this panel has started a fake rig since: it is not for that one.
    Dropped,
    /// The daemon has answered.
    Answered {
        /// Time from the press to the answer.
        after: Duration,
        /// Its answer.
        result: Result<StateReply, WireError>,
    },
}
