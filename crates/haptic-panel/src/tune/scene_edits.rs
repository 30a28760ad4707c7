//! The user's changes of the scene: edits of values, two kept scenes, tries, and comparisons.

use super::edit::{Change, ParameterEdits};
use super::library::Comparison;
use super::saving::Saving;
use super::trial::Trial;
use crate::intent::{Intent, Target};
use crate::notice::Notice;
use crate::update::Answer;
use egui::Id;
use haptic_core::Scene;
use haptic_ipc::{ChangeReply, Changes, MirrorChange, ParameterDescription, SceneRef, WireError, params_of};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Names of the two kept scenes.
pub(crate) const SLOTS: [&str; 2] = ["A", "B"];

/// What the user does to the scene.
#[derive(Debug, Default)]
pub(crate) struct Tuning {
    /// The edits of every parameter of the active scene.
    parameters: Vec<ParameterEdits>,
    /// Whether the table of checks is open.
    pub(crate) checks_are_open: bool,
    /// The scene that was last active with each law.
    of_laws: BTreeMap<&'static str, Scene>,
    pub(crate) slots: [Option<Scene>; 2],
    /// Time over which a scene is loaded, ms.
    pub(crate) ramp_ms: f64,
    pub(crate) trial: Trial,
    /// Outcome of the last load, undo, redo or save.
    pub(crate) report: Option<Notice>,
    pub(crate) comparison: Option<Comparison>,
    pub(crate) saving: Saving,
}

impl Tuning {
    /// Forgets what belongs to another daemon; the user's own things stay.
    pub(crate) fn forget(&mut self) {
        self.saving.would_replace = None;
        *self = Self {
            slots: std::mem::take(&mut self.slots),
            of_laws: std::mem::take(&mut self.of_laws),
            ramp_ms: self.ramp_ms,
            saving: std::mem::take(&mut self.saving),
            ..Self::default()
        };
    }

    /// Forgets the same but the rows of the parameters, which stay in sight.
    pub(crate) fn lose_daemon(&mut self) {
        let names = std::mem::take(&mut self.parameters).into_iter();
        let parameters = names.map(|parameter| ParameterEdits::new(parameter.name));
        let parameters = parameters.collect();
        let checks_are_open = self.checks_are_open;
        self.forget();
        (self.parameters, self.checks_are_open) = (parameters, checks_are_open);
    }

    /// The active scene with another law: what both laws have keeps its value, and the rest has the value that it had
    /// when that law was last active. `None` if there is no such law, or no such scene.
    pub(crate) fn with_law(&mut self, active: &Scene, law: &str) -> Option<Scene> {
        self.of_laws.insert(active.friction.law(), active.clone());
        let changed = active.with_law(law)?.ok()?;
        let before = self.of_laws.get(changed.friction.law()).map(params_of);
        let kept = params_of(active);
        let own = before
            .into_iter()
            .flatten()
            .filter(|(name, _)| !kept.contains_key(name));
        let own: Changes = own.collect();
        let own = own.resolve(&changed).ok().and_then(|own| changed.with(&own).ok());
        // Values that do not go together any more are dropped.
        Some(own.unwrap_or(changed))
    }

    pub(crate) fn parameter(&mut self, name: &str) -> Option<&mut ParameterEdits> {
        self.parameters.iter_mut().find(|parameter| parameter.name == name)
    }

    /// The intent to activate a whole scene.
    pub(crate) fn load(&self, what: impl Into<String>, scene: SceneRef) -> Intent {
        Intent::Load {
            what: what.into(),
            scene,
            ramp_ms: (self.ramp_ms > 0.0).then_some(self.ramp_ms),
        }
    }

    pub(crate) fn keep(&mut self, slot: usize, active: &Scene) {
        self.slots[slot] = Some(active.clone());
        if let Some(comparison) = &mut self.comparison
            && comparison.with == SLOTS[slot]
        {
            let other = SceneRef::from(active.clone());
            *comparison = Comparison::new(SLOTS[slot].to_owned(), other);
        }
    }

    pub(crate) fn active_slot(&self, active: Option<&Scene>) -> Option<usize> {
        let active = active?;
        self.slots.iter().position(|slot| slot.as_ref() == Some(active))
    }

    /// Whether this is the field of a value, and nothing is typed there.
    pub(crate) fn is_untouched_value(&self, field: Id) -> bool {
        let mut edits = self.parameters.iter().flat_map(ParameterEdits::all);
        edits.any(|edit| edit.field == Some(field) && edit.typing.is_none())
    }

    /// Drops half-typed numbers.
    pub(crate) fn discard_typing(&mut self) {
        for (_, edit) in self.parameters.iter_mut().flat_map(ParameterEdits::all_mut) {
            edit.typing = None;
        }
    }

    /// What to send at `now`, and the time until more is due. `revision` is the active one.
    pub(crate) fn due(&mut self, now: Instant, revision: Option<u64>) -> (Vec<Intent>, Option<Duration>) {
        let mut intents = Vec::new();
        let mut waits = Vec::new();
        let is_try = self.trial.is_on;
        for parameter in &mut self.parameters {
            let name = parameter.name.clone();
            for (direction, edit) in parameter.all_mut() {
                match edit.due(now, is_try) {
                    Ok(Change { value, merge }) => {
                        let name = name.clone();
                        let target = Target { name, direction };
                        intents.push(Intent::Set { target, value, merge });
                    }
                    Err(wait) => waits.extend(wait),
                }
            }
        }
        let comparison = self.comparison.as_mut();
        intents.extend(comparison.and_then(|comparison| comparison.due(revision)));
        match self.trial.due(now) {
            Ok(revision) => intents.push(Intent::TakeBack { revision }),
            Err(wait) => waits.extend(wait),
        }
        (intents, waits.into_iter().min())
    }

    pub(crate) fn note_sent(&mut self, intents: &[Intent]) {
        for intent in intents {
            match intent {
                Intent::Set { .. } | Intent::Load { .. } if self.trial.is_on => self.trial.sent(),
                Intent::Try { .. } => self.trial.sent(),
                // The user goes through the changes, the tries included.
                Intent::Undo | Intent::Redo => self.trial.settle(),
                _ => {}
            }
        }
    }

    /// Takes the rows of the parameter table. The edits of a parameter that stays continue.
    pub(crate) fn take_parameters(&mut self, table: &[ParameterDescription]) {
        let mut known = std::mem::take(&mut self.parameters);
        let edits = table.iter().map(|about| {
            let index = known.iter().position(|edits| edits.name == about.name);
            index.map_or_else(
                || ParameterEdits::new(about.name.clone()),
                |index| known.swap_remove(index),
            )
        });
        self.parameters = edits.collect();
    }

    /// Drops remarks that a change of the scene makes void.
    pub(crate) fn take_scene_change(&mut self, change: &MirrorChange) {
        if change.is_new_revision {
            // A refusal belongs to the scene before.
            self.report.take_if(|report| report.outcome.is_err());
            for (_, edit) in self.parameters.iter_mut().flat_map(ParameterEdits::all_mut) {
                edit.refusal = None;
            }
        }
        for name in &change.parameters {
            if let Some(parameter) = self.parameter(name) {
                parameter.overtaken();
            }
        }
    }

    /// Takes the answer to an intent about the scene; gives back an answer to any other.
    pub(crate) fn take_answer(
        &mut self,
        intent: &Intent,
        result: Result<Answer, WireError>,
    ) -> Option<Result<Answer, WireError>> {
        match (intent, result) {
            (Intent::Set { target, .. }, result) => {
                let result = self.take_change(result);
                if let Some(parameter) = self.parameter(&target.name) {
                    parameter.edit(target.direction).answered(result);
                }
            }
            (Intent::Load { what, .. }, result) => {
                let result = self.take_change(result);
                self.report = report(&format!("Loaded {what}"), result);
            }
            (Intent::Try { scene }, result) => {
                let result = self.take_change(result);
                self.report = report(&format!("Tried {}", scene.name), result);
            }
            (Intent::Undo, result) => self.report = report("Undone", changed(result).map(|reply| reply.tick)),
            (Intent::Redo, result) => self.report = report("Done again", changed(result).map(|reply| reply.tick)),
            (Intent::TakeBack { .. }, result) => {
                self.trial.went_back(changed(result).map(|reply| reply.revision));
            }
            (Intent::Save { name, .. }, Ok(Answer::Saved(reply))) => {
                if let Some(comparison) = &mut self.comparison
                    && comparison.with == reply.name
                {
                    comparison.ask_again();
                }
                self.report = Some(self.saving.answered(name, Ok(&reply)));
            }
            (Intent::Save { name, .. }, Err(error)) => {
                self.report = Some(self.saving.answered(name, Err(error)));
            }
            (Intent::Compare { what, scene, revision }, result) => {
                let result = match result {
                    Ok(Answer::Differs(reply)) => Ok(reply.differences),
                    Ok(_) => Err("the daemon's answer is not that to a comparison".to_owned()),
                    Err(error) => Err(error.message),
                };
                if let Some(comparison) = &mut self.comparison {
                    comparison.take(what, scene, *revision, result);
                }
            }
            (_, result) => return Some(result),
        }
        None
    }

    /// Takes the answer to a change that may be a try. Returns the tick that applied it.
    fn take_change(&mut self, result: Result<Answer, WireError>) -> Result<Option<u64>, String> {
        let result = changed(result);
        // A no-op makes no revision that could be taken back.
        let made = result.as_ref().ok().filter(|reply| !reply.changes.is_empty());
        self.trial.answered(made.map(|reply| reply.revision));
        result.map(|reply| reply.tick)
    }
}

/// The answer to a change, or the reason of its refusal.
fn changed(result: Result<Answer, WireError>) -> Result<ChangeReply, String> {
    match result {
        Ok(Answer::Changed(reply)) => Ok(reply),
        Ok(_) => Err("the daemon's answer is not that to a change".to_owned()),
        Err(error) => Err(error.message),
    }
}

/// The outcome of an action, with the tick that applied it.
fn report(action: &str, result: Result<Option<u64>, String>) -> Option<Notice> {
    // No tick applies a scene while none renders it.
    let done = |tick: Option<u64>| match tick {
        None | Some(0) => action.to_owned(),
        Some(tick) => format!("{action} at tick {tick}"),
    };
    Some(Notice::new(result.map(done)))
}
