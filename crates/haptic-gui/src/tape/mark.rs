//! What happened while a tape was written: markers, changes of scene and state, losses.

use crate::theme::Palette;
use egui::Color32;

/// Something that happened at a tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TapeMark {
    pub(crate) tick: u64,
    pub(crate) kind: MarkKind,
    /// What happened, and who did it if that is known.
    pub(crate) text: String,
}

/// What kind of thing it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MarkKind {
    /// A person has marked the moment.
    Marker,
    /// The scene changed.
    Scene,
    /// The state of the rig changed.
    State,
    /// A fault, a lost link, or a loop that was late.
    Trouble,
}

impl MarkKind {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Marker => "Marker",
            Self::Scene => "Scene",
            Self::State => "State",
            Self::Trouble => "Trouble",
        }
    }

    pub(crate) const fn color(self) -> fn(&Palette) -> Color32 {
        match self {
            Self::Marker => |palette| palette.mark,
            Self::Scene => |palette| palette.law,
            Self::State => |palette| palette.sliding,
            Self::Trouble => |palette| palette.error_text,
        }
    }
}
