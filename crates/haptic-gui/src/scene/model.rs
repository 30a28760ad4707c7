//! What the panel knows of the scene, and what the user is doing to it.

use super::advice::Advised;
use super::edit::Change;
use super::parameter::ParameterModel;
use super::tools::SLOTS;
use super::trial::Trial;
use crate::intent::{Intent, Target};
use crate::notice::Notice;
use crate::update::Answer;
use egui::Id;
use haptic_core::Scene;
use haptic_ipc::{
    ChangeReply, Description, Difference, ErrorCode, JournalEntry, ListedScene, LogReply, SceneListReply, SceneRef,
    SceneReply, StateEvent, WireError,
};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Changes of the journal that are kept.
const MOST_ENTRIES: usize = 50;

/// The scene in force and what the user is changing in it.
#[derive(Debug, Default)]
pub(crate) struct SceneModel {
    pub(crate) name: String,
    /// Its friction law.
    pub(crate) law: String,
    pub(crate) parameters: Vec<ParameterModel>,
    /// Revision in force.
    pub(crate) revision: Option<u64>,
    /// The tick that applied it, unless it was in force before the panel listened.
    pub(crate) tick: Option<u64>,
    /// The whole of it, once the daemon has said it.
    pub(crate) in_force: Option<Scene>,
    pub(crate) advised: Advised,
    /// The user wants to see every check.
    pub(crate) checks_are_open: bool,
    pub(crate) undo_depth: usize,
    pub(crate) redo_depth: usize,
    /// Who changed what, the newest last.
    pub(crate) journal: VecDeque<JournalEntry>,
    pub(crate) library: Vec<ListedScene>,
    /// The two scenes that the user switches between.
    pub(crate) slots: [Option<Scene>; 2],
    /// Time over which a scene is loaded, ms.
    pub(crate) ramp_ms: f64,
    pub(crate) trial: Trial,
    /// What became of the last load, undo, redo or save.
    pub(crate) report: Option<Notice>,
    pub(crate) comparison: Option<Comparison>,
    /// The name under which to save, as it is typed.
    pub(crate) save_as: String,
    /// A scene of this name is in the library already; to be replaced if the user says so.
    pub(crate) would_replace: Option<String>,
}

/// In what the scene in force differs from another. It is asked for again whenever one of them changes.
#[derive(Debug)]
pub(crate) struct Comparison {
    pub(crate) with: String,
    other: SceneRef,
    /// The revision that was compared last, or is being compared.
    asked: Option<u64>,
    is_unanswered: bool,
    pub(crate) found: Option<Found>,
}

/// What came of a comparison.
#[derive(Debug)]
pub(crate) struct Found {
    /// Revision of the scene that was in force.
    pub(crate) revision: u64,
    pub(crate) result: Result<Vec<Difference>, String>,
}

impl Comparison {
    pub(crate) fn new(with: String, other: SceneRef) -> Self {
        Self {
            with,
            other,
            asked: None,
            is_unanswered: false,
            found: None,
        }
    }

    /// What to ask while `newest` is in force. One at a time, so that a slider that is dragged does not swamp the daemon.
    fn due(&mut self, newest: Option<u64>) -> Option<Intent> {
        let revision = newest.filter(|_| !self.is_unanswered && self.asked != newest)?;
        (self.asked, self.is_unanswered) = (newest, true);
        Some(Intent::Compare {
            what: self.with.clone(),
            scene: self.other.clone(),
            revision,
        })
    }

    /// Takes an answer, unless it is to another question.
    fn take(&mut self, with: &str, other: &SceneRef, revision: u64, result: Result<Vec<Difference>, String>) {
        if (self.with.as_str(), &self.other, self.asked) == (with, other, Some(revision)) {
            self.is_unanswered = false;
            self.found = Some(Found { revision, result });
        }
    }
}

impl SceneModel {
    /// What is known of another daemon is void; what the user keeps here is not.
    pub(crate) fn forget(&mut self) {
        *self = Self {
            slots: std::mem::take(&mut self.slots),
            ramp_ms: self.ramp_ms,
            save_as: std::mem::take(&mut self.save_as),
            ..Self::default()
        };
    }

    /// A whole scene to put in force.
    pub(crate) fn load(&self, what: impl Into<String>, scene: SceneRef) -> Intent {
        Intent::Load {
            what: what.into(),
            scene,
            ramp_ms: (self.ramp_ms > 0.0).then_some(self.ramp_ms),
        }
    }

    /// Keeps the scene in force in a slot.
    pub(crate) fn keep(&mut self, place: usize) {
        self.slots[place].clone_from(&self.in_force);
        let kept = self.slots[place].clone();
        let comparison = self
            .comparison
            .as_ref()
            .filter(|comparison| comparison.with == SLOTS[place]);
        if let (Some(comparison), Some(kept)) = (comparison, kept) {
            // What was compared with is another now.
            self.comparison = Some(Comparison::new(
                comparison.with.clone(),
                SceneRef::Scene(Box::new(kept)),
            ));
        }
    }

    /// The slot whose scene is in force.
    pub(crate) fn slot_in_force(&self) -> Option<usize> {
        let in_force = self.in_force.as_ref()?;
        self.slots.iter().position(|slot| slot.as_ref() == Some(in_force))
    }

    /// Whether this is the field of a value, and nothing has been typed there yet.
    pub(crate) fn waits_to_be_typed(&self, field: Id) -> bool {
        let mut edits = self.parameters.iter().flat_map(ParameterModel::all_edits);
        edits.any(|edit| edit.field == Some(field) && edit.typing.is_none())
    }

    /// Drops what stands half-typed in the fields.
    pub(crate) fn discard_typing(&mut self) {
        for parameter in &mut self.parameters {
            for (_, edit) in parameter.edits() {
                edit.typing = None;
            }
        }
    }

    /// What is to be sent at `now`, and how long until more is.
    pub(crate) fn due(&mut self, now: Instant) -> (Vec<Intent>, Option<Duration>) {
        let mut intents = Vec::new();
        let mut soonest: Option<Duration> = None;
        let mut wait_for = |wait: Option<Duration>| {
            if let Some(wait) = wait {
                soonest = Some(soonest.map_or(wait, |other| other.min(wait)));
            }
        };
        let is_try = self.trial.is_on;
        for parameter in &mut self.parameters {
            let name = parameter.about.name.clone();
            for (direction, edit) in parameter.edits() {
                match edit.due(now, is_try) {
                    Ok(Change { value, merge }) => {
                        let name = name.clone();
                        let target = Target { name, direction };
                        intents.push(Intent::Set { target, value, merge });
                    }
                    Err(wait) => wait_for(wait),
                }
            }
        }
        let comparison = self.comparison.as_mut();
        intents.extend(comparison.and_then(|comparison| comparison.due(self.revision)));
        match self.trial.due(now) {
            Ok(revision) => intents.push(Intent::TakeBack { revision }),
            Err(wait) => wait_for(wait),
        }
        (intents, soonest)
    }

    /// The user asked for these.
    pub(crate) fn asked(&mut self, intents: &[Intent]) {
        for intent in intents {
            match intent {
                Intent::Set { .. } | Intent::Load { .. } if self.trial.is_on => self.trial.sent(),
                // The user goes through the changes, the tries among them.
                Intent::Undo | Intent::Redo => self.trial.settle(),
                _ => {}
            }
        }
    }

    pub(crate) fn take_description(&mut self, description: Description) {
        let mut known = std::mem::take(&mut self.parameters);
        self.law = description.law;
        for about in description.parameters {
            let place = known.iter().position(|parameter| parameter.about.name == about.name);
            let parameter = match place {
                // What the user is doing to it goes on.
                Some(place) => {
                    let mut parameter = known.swap_remove(place);
                    parameter.take_value(about.value);
                    parameter.about = about;
                    parameter
                }
                None => ParameterModel::new(about),
            };
            self.parameters.push(parameter);
        }
    }

    /// Takes what a state event says of the scene.
    pub(crate) fn take_state(&mut self, event: StateEvent) {
        (self.undo_depth, self.redo_depth) = (event.undo_depth, event.redo_depth);
        if self.revision.is_some_and(|known| event.revision < known) {
            return;
        }
        if self.revision.is_some_and(|known| known != event.revision) {
            self.tick = Some(event.tick);
        }
        self.take_revision(event.revision);
        self.advised.overtaken(event.revision);
        self.name = event.scene;
        if !event.law.is_empty() {
            self.law = event.law;
        }
        for (name, value) in &event.params {
            if let Some(parameter) = self.parameter(name) {
                parameter.take_value(*value);
            }
        }
    }

    pub(crate) fn take_scene(&mut self, reply: SceneReply) {
        if self.revision.is_none_or(|known| reply.revision >= known) {
            self.in_force = Some(reply.scene);
        }
    }

    pub(crate) fn take_library(&mut self, result: Result<SceneListReply, WireError>) {
        // A daemon without a library has none to show.
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
        // The newest of what was asked for and the first of what is told may be the same.
        if self.journal.back().is_some_and(|last| last.seq >= entry.seq) {
            return;
        }
        self.journal.push_back(entry);
        while self.journal.len() > MOST_ENTRIES {
            self.journal.pop_front();
        }
    }

    /// Takes the answer to something that concerns the scene; gives it back where it does not.
    pub(crate) fn take_answer(
        &mut self,
        intent: &Intent,
        result: Result<Answer, WireError>,
    ) -> Option<Result<Answer, WireError>> {
        let refusal = |error: WireError| error.message;
        match (intent, result) {
            (Intent::Set { target, .. }, result) => {
                let result = self.take_change(result).map_err(refusal);
                if let Some(parameter) = self.parameter(&target.name) {
                    parameter.edit(target.direction).answered(result);
                }
            }
            (Intent::Load { what, .. }, result) => {
                let result = self.take_change(result).map_err(refusal);
                self.report = told(&format!("Loaded {what}"), result);
            }
            (Intent::Undo, result) => {
                let result = self.take_applied(result).map(|reply| reply.tick).map_err(refusal);
                self.report = told("Undone", result);
            }
            (Intent::Redo, result) => {
                let result = self.take_applied(result).map(|reply| reply.tick).map_err(refusal);
                self.report = told("Done again", result);
            }
            (Intent::TakeBack { .. }, result) => {
                let result = self.take_applied(result);
                self.trial
                    .went_back(result.map(|reply| reply.revision).map_err(refusal));
            }
            (Intent::Save { .. }, Ok(Answer::Saved(reply))) => {
                self.would_replace = None;
                if let Some(comparison) = self
                    .comparison
                    .as_mut()
                    .filter(|comparison| comparison.with == reply.name)
                {
                    comparison.asked = None;
                }
                self.report = Some(Notice::new(Ok(format!("Saved as {} ({})", reply.name, reply.path))));
            }
            (Intent::Save { name, .. }, Err(error)) => {
                let why = if error.code == ErrorCode::SceneExists {
                    self.would_replace = Some(name.clone());
                    format!("The library has a scene {name} already: save under another name, or replace it")
                } else {
                    error.message
                };
                self.report = Some(Notice::new(Err(why)));
            }
            (Intent::Compare { what, scene, revision }, result) => {
                let result = result.map_err(refusal).and_then(|answer| match answer {
                    Answer::Differs(reply) => Ok(reply.differences),
                    _ => Err("the daemon's answer is not that to a comparison".to_owned()),
                });
                if let Some(comparison) = &mut self.comparison {
                    comparison.take(what, scene, *revision, result);
                }
            }
            (_, result) => return Some(result),
        }
        None
    }

    /// Takes the answer to a change that may be a try.
    fn take_change(&mut self, result: Result<Answer, WireError>) -> Result<Option<u64>, WireError> {
        let result = self.take_applied(result);
        // What was so already has made no revision that could be taken back.
        let made = result.as_ref().ok().filter(|reply| !reply.changes.is_empty());
        self.trial.answered(made.map(|reply| reply.revision));
        result.map(|reply| reply.tick)
    }

    /// Takes an answered change without waiting for the event that follows it, lest the handle jump back meanwhile.
    fn take_applied(&mut self, result: Result<Answer, WireError>) -> Result<ChangeReply, WireError> {
        let Answer::Changed(reply) = result? else {
            let message = "the daemon's answer is not that to a change";
            return Err(WireError::new(ErrorCode::Unknown, message));
        };
        if self.revision.is_some_and(|known| reply.revision < known) {
            return Ok(reply);
        }
        self.take_revision(reply.revision);
        self.tick = reply.tick;
        self.advised.take_remarks(&reply);
        for (key, &value) in &reply.applied {
            let name = key.trim_end_matches(['+', '-']);
            let Some(parameter) = self.parameter(name) else {
                continue;
            };
            let mut changed = parameter.about.value;
            if !key.ends_with('-') {
                changed.positive = value;
            }
            if !key.ends_with('+') {
                changed.negative = value;
            }
            parameter.take_value(changed);
        }
        Ok(reply)
    }

    fn take_revision(&mut self, revision: u64) {
        if self.revision != Some(revision) {
            // What was refused was a change of another scene.
            self.report.take_if(|report| report.told.is_err());
            for parameter in &mut self.parameters {
                for (_, edit) in parameter.edits() {
                    edit.forget_refusal();
                }
            }
        }
        self.revision = Some(revision);
    }

    fn parameter(&mut self, name: &str) -> Option<&mut ParameterModel> {
        let mut parameters = self.parameters.iter_mut();
        parameters.find(|parameter| parameter.about.name == name)
    }
}

/// What became of something, with the tick that did it.
fn told(what: &str, result: Result<Option<u64>, String>) -> Option<Notice> {
    let done = |tick: Option<u64>| tick.map_or_else(|| what.to_owned(), |tick| format!("{what} at tick {tick}"));
    Some(Notice::new(result.map(done)))
}
