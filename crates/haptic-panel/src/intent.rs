//! The intents of the user.

use crate::identify::Question;
use crate::record::Listed;
use crate::study::StudyCommand;
use haptic_core::scene::SceneFile;
use haptic_core::{Direction, Scene};
use haptic_ipc::{ANYWAY, ChangeOptions, Request, SceneRef, Topic, WireError};
use haptic_recording::Metadata;
use std::fmt;
use std::path::PathBuf;

/// Time between batches of samples, ms: that of the quickest frames.
pub(crate) const BATCH_MS: u32 = 34;

/// Time over which a scene is tried, ms: a hand has time to notice that the surface changes.
const TRY_RAMP_MS: f64 = 200.0;

/// A parameter, or one direction of it, by its name on the wire.
///
/// The names come from the daemon's `describe`, so a parameter that is unknown to this program can be tuned
/// as well.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Target {
    /// Name of the parameter.
    pub name: String,
    /// One direction of it, or both.
    pub direction: Option<Direction>,
}

impl fmt::Display for Target {
    /// Writes the key as the protocol takes it: `mass`, `static_force+`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        f.write_str(match self.direction {
            None => "",
            Some(Direction::Positive) => "+",
            Some(Direction::Negative) => "-",
        })
    }
}

/// An intent of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Intent {
    /// Ramp the force up.
    Engage,
    /// Ramp the force down.
    Release,
    /// Zero force at once.
    Stop,
    /// Clear a stop or a fault.
    Reset,
    /// Say that the device is the rig that was commissioned.
    SameRig,
    /// What was refused because the rig would chatter, all the same.
    Anyway(Box<Self>),
    /// Change a parameter.
    Set {
        /// The parameter.
        target: Target,
        /// Its new value, in the parameter's unit.
        value: f64,
        /// Whether `undo` takes it back together with the change before, as during a drag.
        merge: bool,
    },
    /// Activate a whole scene.
    Load {
        /// Its name for people.
        what: String,
        /// The scene.
        scene: SceneRef,
        /// Duration of the change, ms; at once if absent.
        ramp_ms: Option<f64>,
    },
    /// Take back the newest change of any client.
    Undo,
    /// Repeat the change that was undone.
    Redo,
    /// Take back a try, unless another change has followed it.
    TakeBack {
        /// Its revision.
        revision: u64,
    },
    /// Save a scene to the library.
    Save {
        /// Its name there.
        name: String,
        /// Whether it may replace a scene of the same name.
        replace: bool,
        /// The scene; the active one if absent.
        scene: Option<Box<Scene>>,
    },
    /// List the differences between an active scene and another.
    Compare {
        /// Name of the other scene for people.
        what: String,
        /// The other scene.
        scene: SceneRef,
        /// Revision of the active scene.
        revision: u64,
    },
    /// Export the plots into a file.
    Export {
        /// The format.
        format: Format,
        /// The folder.
        folder: PathBuf,
    },
    /// Choose a file or a folder in a dialog of the desktop, and use it.
    Choose {
        /// What for.
        purpose: DialogPurpose,
        /// Where the dialog begins: a file or a folder.
        near: PathBuf,
    },
    /// Write every sample from now on into a new file.
    Record {
        /// The folder.
        folder: PathBuf,
        /// The format of the file.
        format: haptic_recording::Format,
        /// The head of the file.
        metadata: Box<Metadata>,
    },
    /// Set a marker in the recording that is written.
    Marker {
        /// The tick.
        tick: u64,
        /// What it is called.
        text: String,
    },
    /// End the recording.
    EndRecording,
    /// Open a recording.
    Open {
        /// Its file.
        path: PathBuf,
    },
    /// List the recordings of a folder.
    List {
        /// The folder.
        folder: PathBuf,
        /// What is known of it, and is not read again.
        known: Vec<Listed>,
    },
    /// Render a scene along a recording's motion.
    WhatIf {
        /// Number of this question, which its answer has too.
        number: u64,
        /// The recording's file.
        path: PathBuf,
        /// Another scene, or those of the recording.
        scene: Option<Box<SceneFile>>,
    },
    /// Ask the daemon for a scene of its library, to render it so.
    WhatIfSaved {
        /// Number of this question, which its answer has too.
        number: u64,
        /// The recording's file.
        path: PathBuf,
        /// Name of the scene.
        name: String,
    },
    /// Give the rendering up.
    CancelWhatIf,
    /// Read the names of a file's columns.
    ReadHeadings {
        /// The file.
        path: PathBuf,
    },
    /// Identify mass and friction.
    Identify {
        /// Number of this question, which its answer has too.
        number: u64,
        /// The question.
        question: Box<Question>,
    },
    /// Give the identification up.
    CancelIdentify,
    /// Hear what would be remarked on a scene; nothing changes.
    Foresee {
        /// The scene.
        scene: Box<Scene>,
    },
    /// Take a lease, which releases the rig should the panel be lost, or end it with 0.
    Lease {
        /// Longest silence of the panel, ms.
        timeout_ms: u32,
    },
    /// Activate a scene for a moment; the panel takes it back by itself.
    Try {
        /// The scene.
        scene: Box<Scene>,
    },
    /// A command to the study with a person.
    Study(StudyCommand),
    /// Activate the scene of a study's trial, unless somebody else has changed the scene.
    TrialScene {
        /// The scene.
        scene: Box<Scene>,
        /// The revision before.
        if_revision: u64,
        /// Duration of the change, ms.
        ramp_ms: f64,
    },
    /// Point where the hand on the fake rig reaches to.
    Hand {
        /// Where to, m.
        target_m: f64,
    },
    /// Start a daemon with the fake rig, which ends with the window.
    StartFakeRig,
    /// Connect to another rig, and look only there from now on.
    ConnectTo {
        /// Its socket.
        path: PathBuf,
    },
    /// Hear of every tick in batches.
    Stream {
        /// Time between two batches, ms.
        batch_ms: u32,
    },
}

/// What a dialog of the desktop is opened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialogPurpose {
    /// A recording to open.
    Recording,
    /// A file to identify.
    FileToIdentify,
    /// The folder of recordings and exports.
    Folder,
    /// The folder of a study.
    StudyFolder,
    /// The plan of a study.
    StudyPlan,
    /// The file that the plots are exported to.
    Export(Format),
}

impl DialogPurpose {
    /// The title of its dialog.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Recording => "Open a recording",
            Self::FileToIdentify => "Choose a file to identify",
            Self::Folder => "Choose the folder for recordings and exports",
            Self::StudyFolder => "Choose the folder of the study",
            Self::StudyPlan => "Choose the plan of the study",
            Self::Export(_) => "Export the plots",
        }
    }
}

/// A format of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The pixels.
    Png,
    /// Lines and text, for a paper.
    Svg,
    /// The samples, for further work.
    Csv,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Png, Self::Svg, Self::Csv];

    /// Ending of such a file's name.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Svg => "svg",
            Self::Csv => "csv",
        }
    }
}

impl Intent {
    /// Whether it is a command that changes what the hand feels, but for a stop.
    pub(crate) const fn moves_rig(&self) -> bool {
        matches!(
            self,
            Self::Engage
                | Self::Release
                | Self::Reset
                | Self::SameRig
                | Self::Anyway(_)
                | Self::Set { .. }
                | Self::Load { .. }
                | Self::Undo
                | Self::Redo
                | Self::Try { .. }
                | Self::Study(StudyCommand::GoOn)
                | Self::Hand { .. }
        )
    }

    /// The intent as a request of the protocol; `None` if the panel carries it out itself.
    #[must_use]
    pub fn request(&self) -> Option<Request> {
        Some(match self {
            Self::Engage => Request::engage(),
            Self::Release => Request::Release {},
            Self::Stop => Request::Stop {},
            Self::Reset => Request::Reset {},
            Self::SameRig => Request::CommissionConfirm {},
            Self::Anyway(intent) => intent.request()?.anyway(),
            Self::Set { target, value, merge } => Request::Set {
                params: [(target.to_string(), *value)].into_iter().collect(),
                merge: *merge,
                options: ChangeOptions::default(),
            },
            Self::Load { scene, ramp_ms, .. } => Request::SceneLoad {
                scene: scene.clone(),
                options: ChangeOptions {
                    ramp_ms: *ramp_ms,
                    ..ChangeOptions::default()
                },
            },
            Self::Undo => Request::undo(),
            Self::Redo => Request::redo(),
            Self::TakeBack { revision } => Request::Undo {
                options: ChangeOptions {
                    if_revision: Some(*revision),
                    ..ChangeOptions::default()
                },
            },
            Self::Save { name, replace, scene } => Request::SceneSave {
                name: name.clone(),
                scene: scene.clone().map(|scene| SceneRef::from(*scene)),
                replace: *replace,
            },
            Self::Compare { scene, revision, .. } => Request::SceneDiff {
                from: scene.clone(),
                to: Some(SceneRef::Revision(*revision)),
            },
            Self::WhatIfSaved { name, .. } => Request::Get {
                scene: Some(SceneRef::Name(name.clone())),
            },
            Self::Foresee { scene } => Request::SceneLoad {
                scene: SceneRef::from(Scene::clone(scene)),
                options: ChangeOptions {
                    dry_run: true,
                    ..ChangeOptions::default()
                },
            },
            Self::Lease { timeout_ms } => Request::Lease {
                timeout_ms: *timeout_ms,
            },
            Self::Try { scene } => Request::SceneLoad {
                scene: SceneRef::from(Scene::clone(scene)),
                options: ChangeOptions {
                    ramp_ms: Some(TRY_RAMP_MS),
                    ..ChangeOptions::default()
                },
            },
            Self::TrialScene {
                scene,
                if_revision,
                ramp_ms,
            } => Request::SceneLoad {
                scene: SceneRef::from(Scene::clone(scene)),
                options: ChangeOptions {
                    if_revision: Some(*if_revision),
                    ramp_ms: Some(*ramp_ms),
                    ..ChangeOptions::default()
                },
            },
            Self::Hand { target_m } => Request::Hand { target_m: *target_m },
            Self::Stream { batch_ms } => Request::Subscribe {
                topics: vec![Topic::State, Topic::Timing, Topic::Samples, Topic::Snapshot, Topic::Log],
                // Every tick: a spike of a single one must be visible.
                rate_hz: None,
                batch_ms: Some(*batch_ms),
            },
            Self::Export { .. }
            | Self::Choose { .. }
            | Self::StartFakeRig
            | Self::ConnectTo { .. }
            | Self::Study(_)
            | Self::Record { .. }
            | Self::Marker { .. }
            | Self::EndRecording
            | Self::Open { .. }
            | Self::List { .. }
            | Self::WhatIf { .. }
            | Self::CancelWhatIf
            | Self::ReadHeadings { .. }
            | Self::Identify { .. }
            | Self::CancelIdentify => return None,
        })
    }

    /// Whether it switches the force: a later stop makes it void, so that it cannot bring the force back.
    #[must_use]
    pub fn is_void_after_stop(&self) -> bool {
        matches!(self.itself(), Self::Engage | Self::Release | Self::Reset | Self::Stop)
    }

    /// A refusal of it in the words of the panel, which has a button for an option of the command line, or none.
    pub(crate) fn refused(&self, mut refusal: WireError) -> WireError {
        let button = match self {
            Self::Engage => "; the button Anyway does it all the same",
            Self::Set { .. } | Self::Load { .. } | Self::Try { .. } | Self::Undo | Self::Redo => {
                "; the button Change anyway, below the parameters, does it all the same"
            }
            _ => "",
        };
        refusal.message = refusal.message.replace(ANYWAY, button);
        refusal
    }

    /// The intent, whether or not it is to be carried out anyway.
    #[must_use]
    pub fn itself(&self) -> &Self {
        match self {
            Self::Anyway(intent) => intent,
            intent => intent,
        }
    }
}

impl fmt::Display for Intent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Engage => f.write_str("engage"),
            Self::Release => f.write_str("release"),
            Self::Stop => f.write_str("stop"),
            Self::Reset => f.write_str("reset"),
            Self::SameRig => f.write_str("same rig"),
            Self::Anyway(intent) => write!(f, "{intent}, anyway"),
            Self::Set { target, value, .. } => write!(f, "set {target} = {value}"),
            Self::Load { what, .. } => write!(f, "load {what}"),
            Self::Undo => f.write_str("undo"),
            Self::Redo => f.write_str("redo"),
            Self::TakeBack { .. } => f.write_str("take the try back"),
            Self::Save { name, .. } => write!(f, "save {name}"),
            Self::Compare { what, revision, .. } => write!(f, "compare revision {revision} with {what}"),
            Self::WhatIfSaved { name, .. } => write!(f, "what if {name}"),
            Self::Foresee { scene } => write!(f, "foresee {}", scene.name),
            Self::Lease { timeout_ms } => write!(f, "lease for {timeout_ms} ms"),
            Self::Try { scene } => write!(f, "try {}", scene.name),
            Self::TrialScene { scene, .. } => write!(f, "load the trial's scene {}", scene.name),
            Self::Hand { target_m } => write!(f, "point the hand at {target_m} m"),
            Self::Stream { batch_ms } => write!(f, "hear of samples every {batch_ms} ms"),
            // What the panel carries out itself is in no message.
            other => write!(f, "{other:?}"),
        }
    }
}
