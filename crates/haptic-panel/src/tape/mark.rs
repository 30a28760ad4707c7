//! What happened while a tape was written: markers, changes of scene and state, losses.

use crate::theme::Palette;
use egui::Color32;
use haptic_ipc::{JournalEntry, RigState};

/// Something that happened at a tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TapeMark {
    pub(crate) tick: u64,
    pub(crate) kind: MarkKind,
    /// Who did it, if that is known.
    pub(crate) by: Option<String>,
    pub(crate) text: String,
}

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

impl std::fmt::Display for TapeMark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(by) = &self.by {
            write!(f, "{by}: ")?;
        }
        f.write_str(&self.text)
    }
}

impl TapeMark {
    /// An entry of the journal; `None` if it changed neither scene nor state, or no tick carried it out.
    pub(crate) fn of_journal(entry: &JournalEntry) -> Option<Self> {
        let kind = match &entry.state {
            Some(state) if state.after == RigState::Faulted => MarkKind::Trouble,
            Some(_) => MarkKind::State,
            None if !entry.changes.is_empty() => MarkKind::Scene,
            // What nobody asked for comes without the change of state.
            None => match entry.op.as_str() {
                "fault" | "disconnected" | "connected" | "lease_lapsed" => MarkKind::Trouble,
                "stop" | "release" => MarkKind::State,
                _ => return None,
            },
        };
        let by = entry
            .by
            .as_ref()
            .map_or_else(|| "hapticd".to_owned(), ToString::to_string);
        Some(Self {
            tick: entry.tick?,
            kind,
            by: Some(by),
            text: in_words(entry),
        })
    }
}

/// What an entry of the journal says, without time and author.
pub(crate) fn in_words(entry: &JournalEntry) -> String {
    let mut parts = vec![entry.op.clone()];
    parts.extend(entry.state.map(|state| format!("{} -> {}", state.before, state.after)));
    parts.extend(entry.changes.iter().map(ToString::to_string));
    parts.extend(entry.message.clone());
    parts.join(", ")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_asked_for_is_marked_too() {
        let kind = |op: &str| {
            let tick = Some(7);
            let entry = JournalEntry {
                tick,
                ..JournalEntry::of(op)
            };
            TapeMark::of_journal(&entry).map(|mark| mark.kind)
        };
        let kinds = ["fault", "disconnected", "stop", "release", "scene.save"].map(kind);
        let (trouble, state) = (Some(MarkKind::Trouble), Some(MarkKind::State));
        assert_eq!(kinds, [trouble, trouble, state, state, None]);
    }
}
