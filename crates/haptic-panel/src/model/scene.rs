//! The active scene, as the daemon last stated it.

use super::advice::Advised;
use crate::intent::Intent;
use crate::notice::Notice;
use crate::update::Answer;
use crate::wording::significant;
use haptic_core::{Directional, Scene, adviser};
use haptic_ipc::{
    ChangeReply, Description, ErrorCode, JournalEntry, ListedScene, LogReply, ParameterDescription, SceneListReply,
    SceneReply, SceneSaveReply, StateEvent, WireError,
};
use std::cell::OnceCell;
use std::collections::VecDeque;

/// Entries of the journal that are kept.
const MAX_ENTRIES: usize = 50;

/// What the panel knows of the active scene.
#[derive(Debug, Default)]
pub(crate) struct SceneFacts {
    pub(crate) name: String,
    /// Its friction law.
    pub(crate) law: String,
    /// The rows of the parameter table, with the active values.
    pub(crate) parameters: Vec<ParameterDescription>,
    pub(crate) revision: Option<u64>,
    /// The tick that applied it, unless it was active before the panel listened.
    pub(crate) tick: Option<u64>,
    /// The whole scene, once the daemon has stated it.
    pub(crate) active: Option<Scene>,
    pub(crate) advised: Advised,
    /// What [`stick_slip`](Self::stick_slip) has reckoned.
    stick_slip: OnceCell<Option<String>>,
    pub(crate) undo_depth: usize,
    pub(crate) redo_depth: usize,
    /// The changes and who made them, newest last.
    pub(crate) journal: VecDeque<JournalEntry>,
    pub(crate) library: Vec<ListedScene>,
    /// The change that was refused last, if that was because the rig would chatter.
    pub(crate) would_chatter: Option<Intent>,
}

/// What a piece of news changes of the scene. Remarks on older values are void.
#[derive(Debug, Default)]
#[must_use]
pub(crate) struct SceneChange {
    pub(crate) is_new_revision: bool,
    /// Names of the parameters that have other values.
    pub(crate) parameters: Vec<String>,
}

/// Speeds of a hand for which stick-slip is reckoned, mm/s: from a ramp to a fast stroke.
const SPEEDS_MMPS: [f64; 4] = [1.0, 5.0, 20.0, 100.0];

fn stick_slip_in_words(scene: &Scene) -> Option<String> {
    let at = |speed: f64| {
        let found = adviser::stick_slip(scene, speed * 1e-3).ok()?;
        let frequency = found.map_or_else(
            || "none".to_owned(),
            |found| format!("{} Hz", significant(found.frequency_hz, 3)),
        );
        Some(format!("{frequency} at {speed} mm/s"))
    };
    let known: Option<Vec<String>> = SPEEDS_MMPS.into_iter().map(at).collect();
    Some(known?.join(", "))
}

impl SceneFacts {
    pub(crate) fn take_description(&mut self, description: Description) -> SceneChange {
        let known = std::mem::replace(&mut self.parameters, description.parameters);
        self.law = description.law;
        let is_other = |about: &&ParameterDescription| {
            let mut known = known.iter();
            known.any(|known| known.name == about.name && known.value != about.value)
        };
        let parameters = self.parameters.iter().filter(is_other);
        SceneChange {
            is_new_revision: false,
            parameters: parameters.map(|about| about.name.clone()).collect(),
        }
    }

    pub(crate) fn take_state(&mut self, event: StateEvent) -> SceneChange {
        (self.undo_depth, self.redo_depth) = (event.undo_depth, event.redo_depth);
        if self.is_older(event.revision) {
            return SceneChange::default();
        }
        if self.revision.is_some_and(|known| known != event.revision) {
            self.tick = Some(event.tick);
        }
        let mut change = self.take_revision(event.revision);
        self.advised.overtaken(event.revision);
        self.name = event.scene;
        if !event.law.is_empty() {
            self.law = event.law;
        }
        for (name, value) in event.params {
            self.take_value(name, |_| value, &mut change);
        }
        change
    }

    /// Takes an answered change without waiting for the event after it: otherwise a slider would jump
    /// back meanwhile.
    pub(crate) fn take_reply(&mut self, reply: &ChangeReply) -> SceneChange {
        if self.is_older(reply.revision) {
            return SceneChange::default();
        }
        let mut change = self.take_revision(reply.revision);
        self.tick = reply.tick.or(self.tick);
        self.advised.take_remarks(reply);
        for (key, &value) in &reply.applied {
            let name = key.trim_end_matches(['+', '-']).to_owned();
            let changed = |before: Directional| Directional {
                positive: if key.ends_with('-') { before.positive } else { value },
                negative: if key.ends_with('+') { before.negative } else { value },
            };
            self.take_value(name, changed, &mut change);
        }
        change
    }

    /// How often its block lets go of hands of some speeds, in words; `None` where that is not reckoned. It is when it
    /// is first looked at: a slider that is dragged brings a scene in every frame.
    pub(crate) fn stick_slip(&self) -> Option<&str> {
        let scene = self.active.as_ref()?;
        self.stick_slip.get_or_init(|| stick_slip_in_words(scene)).as_deref()
    }

    /// Notes what became of a change.
    pub(crate) fn take_outcome(&mut self, change: &Intent, result: &Result<Answer, WireError>) {
        self.would_chatter = match result {
            Err(error) if error.code == ErrorCode::WouldChatter => Some(change.clone()),
            _ => None,
        };
    }

    pub(crate) fn take_scene(&mut self, reply: SceneReply) {
        if !self.is_older(reply.revision) {
            self.stick_slip = OnceCell::new();
            self.active = Some(reply.scene);
        }
    }

    pub(crate) fn take_library(&mut self, result: Result<SceneListReply, WireError>) {
        // A daemon without a library refuses.
        self.library = result.map(|reply| reply.scenes).unwrap_or_default();
    }

    pub(crate) fn take_journal(&mut self, result: Result<LogReply, WireError>) {
        let newer = std::mem::take(&mut self.journal);
        let older = result.map(|reply| reply.entries).unwrap_or_default();
        for entry in older.into_iter().chain(newer) {
            self.take_entry(entry);
        }
    }

    pub(crate) fn take_entry(&mut self, entry: JournalEntry) {
        // The newest entry of the answer and the first event may be the same.
        if self.journal.back().is_some_and(|last| last.seq >= entry.seq) {
            return;
        }
        self.journal.push_back(entry);
        while self.journal.len() > MAX_ENTRIES {
            self.journal.pop_front();
        }
    }

    fn is_older(&self, revision: u64) -> bool {
        self.revision.is_some_and(|known| revision < known)
    }

    fn take_revision(&mut self, revision: u64) -> SceneChange {
        let is_new_revision = self.revision.replace(revision) != Some(revision);
        SceneChange {
            is_new_revision,
            parameters: Vec::new(),
        }
    }

    fn take_value(&mut self, name: String, value: impl Fn(Directional) -> Directional, change: &mut SceneChange) {
        let mut parameters = self.parameters.iter_mut();
        let Some(about) = parameters.find(|about| about.name == name) else {
            return;
        };
        let value = value(about.value);
        if about.value != value {
            about.value = value;
            change.parameters.push(name);
        }
    }
}

/// A scene is in the library now.
pub(super) fn saved(reply: &SceneSaveReply) -> Notice {
    Notice::new(Ok(format!("Saved as {} ({})", reply.name, reply.path)))
}

/// It was not saved; `would_replace` becomes its name where a scene of that name is there.
pub(super) fn save_refused(name: &str, error: WireError, would_replace: &mut Option<String>) -> Notice {
    let why = if error.code == ErrorCode::SceneExists {
        *would_replace = Some(name.to_owned());
        format!("The library has a scene {name} already: save under another name, or replace it")
    } else {
        error.message
    };
    Notice::new(Err(why))
}
