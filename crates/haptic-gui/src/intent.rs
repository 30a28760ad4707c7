//! What the user asked for.

use haptic_core::Direction;
use haptic_ipc::{ChangeOptions, Request, SceneRef};
use haptic_lab::recording::Metadata;
use std::fmt;
use std::path::PathBuf;

/// A parameter, or one direction of it, by its name on the wire.
///
/// The names come from the daemon's `describe`, so a parameter that this program has never heard of can be tuned too.
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

/// Something that the user wants.
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
    /// Change a parameter.
    Set {
        /// Which one.
        target: Target,
        /// Its new value, in the parameter's unit.
        value: f64,
        /// Whether `undo` takes it back together with the change before, as all of a drag.
        merge: bool,
    },
    /// Put a whole scene in force.
    Load {
        /// What people call it.
        what: String,
        /// The scene.
        scene: SceneRef,
        /// Time over which to go there, ms; at once when absent.
        ramp_ms: Option<f64>,
    },
    /// Take the newest change back, whoever made it.
    Undo,
    /// Bring back what was undone.
    Redo,
    /// Take a change back that was only tried, unless another has followed it.
    TakeBack {
        /// Its revision.
        revision: u64,
    },
    /// Keep the scene in force in the library.
    Save {
        /// Its name there.
        name: String,
        /// Whether it may take the place of one that is there.
        replace: bool,
    },
    /// Say in what a scene that was put in force differs from another.
    Compare {
        /// What people call the other.
        what: String,
        /// The other.
        scene: SceneRef,
        /// Revision of the one that was put in force.
        revision: u64,
    },
    /// Write what the plots show into a file.
    Export {
        /// In this form.
        format: Format,
        /// In this folder.
        folder: PathBuf,
    },
    /// Write every sample from now on into a new file.
    Record {
        /// The folder.
        folder: PathBuf,
        /// What stands at its head.
        metadata: Box<Metadata>,
    },
    /// End the recording.
    EndRecording,
    /// Look at a recording.
    Open {
        /// Its file.
        path: PathBuf,
    },
}

/// A form in which the plots can be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The pixels as they are.
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
    /// The intent as a request of the protocol; nothing where the panel does it itself.
    #[must_use]
    pub fn request(&self) -> Option<Request> {
        Some(match self {
            Self::Engage => Request::Engage {},
            Self::Release => Request::Release {},
            Self::Stop => Request::Stop {},
            Self::Reset => Request::Reset {},
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
            Self::Save { name, replace } => Request::SceneSave {
                name: name.clone(),
                scene: None,
                replace: *replace,
            },
            Self::Compare { scene, revision, .. } => Request::SceneDiff {
                from: scene.clone(),
                to: Some(SceneRef::Revision(*revision)),
            },
            Self::Export { .. } | Self::Record { .. } | Self::EndRecording | Self::Open { .. } => return None,
        })
    }

    /// Whether it is about the force being on at all: beside a stop it is void, lest it bring the force back.
    #[must_use]
    pub const fn is_void_after_stop(&self) -> bool {
        matches!(self, Self::Engage | Self::Release | Self::Reset | Self::Stop)
    }
}

impl fmt::Display for Intent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Engage => f.write_str("engage"),
            Self::Release => f.write_str("release"),
            Self::Stop => f.write_str("stop"),
            Self::Reset => f.write_str("reset"),
            Self::Set { target, value, .. } => write!(f, "set {target} = {value}"),
            Self::Load { what, .. } => write!(f, "load {what}"),
            Self::Undo => f.write_str("undo"),
            Self::Redo => f.write_str("redo"),
            Self::TakeBack { .. } => f.write_str("take the try back"),
            Self::Save { name, .. } => write!(f, "save {name}"),
            Self::Compare { what, revision, .. } => write!(f, "compare revision {revision} with {what}"),
            Self::Export { format, .. } => write!(f, "export {}", format.extension()),
            Self::Record { folder, .. } => write!(f, "record in {}", folder.display()),
            Self::EndRecording => f.write_str("end the recording"),
            Self::Open { path } => write!(f, "open {}", path.display()),
        }
    }
}
