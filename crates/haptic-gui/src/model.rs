//! What the panel knows: a fold over the daemon's news.

use crate::advice::Advised;
use crate::edit::Edit;
use crate::history::History;
use crate::intent::{Intent, Target};
use crate::update::{Answer, Update};
use haptic_core::{Direction, Directional};
use haptic_ipc::{
    ChangeReply, Description, Event, ParameterDescription, RigState, StateEvent, StateReply, Timing, WireError,
};
use std::path::PathBuf;
use std::time::Duration;

/// Everything that the panel shows.
#[derive(Debug)]
pub struct Model {
    link: Link,
    rig: Option<Rig>,
    scene: SceneModel,
    history: History,
    timing: Option<Timing>,
    losses: Losses,
    stop: StopReport,
    /// Why the daemon refused to engage, release or reset.
    refusal: Option<String>,
}

/// The way to the daemon.
#[derive(Debug)]
pub(crate) enum Link {
    Connecting { path: PathBuf },
    Connected { path: PathBuf, server: String },
    Lost { path: PathBuf, reason: String },
}

/// The rig, as the daemon last described it.
#[derive(Debug)]
pub(crate) struct Rig {
    pub(crate) state: RigState,
    pub(crate) fault: Option<String>,
    /// The tick at which this was so.
    pub(crate) tick: u64,
}

/// The scene in force and what the user is changing in it.
#[derive(Debug, Default)]
pub(crate) struct SceneModel {
    pub(crate) name: String,
    pub(crate) parameters: Vec<ParameterModel>,
    /// Revision in force.
    pub(crate) revision: Option<u64>,
    /// The tick that applied it, unless it was in force before the panel listened.
    pub(crate) tick: Option<u64>,
    pub(crate) advised: Advised,
    /// The user wants to see every check.
    pub(crate) checks_are_open: bool,
}

/// One parameter.
#[derive(Debug)]
pub(crate) struct ParameterModel {
    /// Its row of the table; `value` is the value in force.
    pub(crate) about: ParameterDescription,
    /// The user wants a row for each direction.
    pub(crate) split: bool,
    /// The user wants to read all that the adviser says of it.
    pub(crate) advice_is_open: bool,
    both: Edit,
    positive: Edit,
    negative: Edit,
}

/// What was lost on the way here.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    /// Rows that the daemon could not send to this panel.
    pub(crate) rows: u64,
    /// Lines that this program cannot read, and why not.
    pub(crate) unreadable: u64,
    pub(crate) unreadable_reason: String,
}

/// What became of the user's last stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum StopReport {
    /// None was asked for, or the daemon has carried it out: the state of the rig says so.
    Settled,
    /// Sent and not answered.
    Sent,
    /// The daemon did not carry it out.
    Failed { reason: String },
    /// The daemon cannot be reached.
    Unreachable,
}

impl ParameterModel {
    fn new(about: ParameterDescription) -> Self {
        Self {
            about,
            split: false,
            advice_is_open: false,
            both: Edit::default(),
            positive: Edit::default(),
            negative: Edit::default(),
        }
    }

    /// Whether each direction has a row: always when they differ.
    pub(crate) fn is_split(&self) -> bool {
        self.about.directional && (self.split || !self.about.value.is_symmetric())
    }

    /// The value in force, of both directions or of one.
    pub(crate) fn in_force(&self, direction: Option<Direction>) -> f64 {
        self.about.value.get(direction.unwrap_or(Direction::Positive))
    }

    pub(crate) fn edit(&mut self, direction: Option<Direction>) -> &mut Edit {
        match direction {
            None => &mut self.both,
            Some(Direction::Positive) => &mut self.positive,
            Some(Direction::Negative) => &mut self.negative,
        }
    }

    /// Makes both directions equal again, at the value of the positive one.
    pub(crate) fn join(&mut self) {
        self.split = false;
        if !self.about.value.is_symmetric() {
            self.both.change(self.about.value.positive);
        }
    }

    fn edits(&mut self) -> [(Option<Direction>, &mut Edit); 3] {
        [
            (None, &mut self.both),
            (Some(Direction::Positive), &mut self.positive),
            (Some(Direction::Negative), &mut self.negative),
        ]
    }

    fn take_value(&mut self, value: Directional) {
        if self.about.value != value {
            self.about.value = value;
            for (_, edit) in self.edits() {
                edit.overtaken();
            }
        }
    }
}

impl Default for Model {
    fn default() -> Self {
        Self {
            link: Link::Connecting { path: PathBuf::new() },
            rig: None,
            scene: SceneModel::default(),
            history: History::default(),
            timing: None,
            losses: Losses::default(),
            stop: StopReport::Settled,
            refusal: None,
        }
    }
}

impl Model {
    /// A panel that has heard nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a piece of news.
    pub fn apply(&mut self, update: Update) {
        match update {
            Update::Connecting { path } => self.link = Link::Connecting { path },
            Update::Connected { path, hello } => {
                self.forget();
                let server = hello.server;
                self.link = Link::Connected { path, server };
                if self.stop == StopReport::Unreachable {
                    self.stop = StopReport::Sent;
                }
            }
            Update::Disconnected { path, reason } => {
                self.forget();
                self.link = Link::Lost { path, reason };
                self.stop = match std::mem::replace(&mut self.stop, StopReport::Settled) {
                    StopReport::Settled => StopReport::Settled,
                    StopReport::Sent | StopReport::Unreachable | StopReport::Failed { .. } => StopReport::Unreachable,
                };
            }
            Update::Described(description) => self.take_description(description),
            Update::Advised(result) => self.scene.advised.take(result, self.scene.revision),
            // A topic that nobody here asked for.
            Update::Event(Event::Unknown | Event::Log(_)) => {}
            Update::Event(Event::State(event)) => self.take_state(event),
            Update::Event(Event::Timing(timing)) => self.timing = Some(*timing),
            Update::Event(Event::Samples(batch)) => {
                self.losses.rows = self.losses.rows.saturating_add(batch.dropped);
                self.history.extend(batch.rows);
            }
            Update::Answered { intent, result } => self.take_answer(&intent, result),
            Update::Unreadable { reason } => {
                self.losses.unreadable += 1;
                self.losses.unreadable_reason = reason;
            }
        }
    }

    /// Whether a daemon is there to talk to.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        matches!(self.link, Link::Connected { .. })
    }

    pub(crate) fn link(&self) -> &Link {
        &self.link
    }

    pub(crate) fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref()
    }

    pub(crate) fn scene(&self) -> &SceneModel {
        &self.scene
    }

    pub(crate) fn scene_mut(&mut self) -> &mut SceneModel {
        &mut self.scene
    }

    pub(crate) fn history(&self) -> &History {
        &self.history
    }

    pub(crate) fn timing(&self) -> Option<&Timing> {
        self.timing.as_ref()
    }

    pub(crate) fn losses(&self) -> &Losses {
        &self.losses
    }

    pub(crate) fn stop(&self) -> &StopReport {
        &self.stop
    }

    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// The user asked for a stop.
    pub(crate) fn stop_asked(&mut self) {
        self.stop = if self.is_connected() {
            StopReport::Sent
        } else {
            StopReport::Unreachable
        };
    }

    /// Drops what stands half-typed in the fields.
    pub(crate) fn discard_typing(&mut self) {
        for parameter in &mut self.scene.parameters {
            for (_, edit) in parameter.edits() {
                edit.typing = None;
            }
        }
    }

    /// The changes to be sent at `now` (s of interface time), and how long until more are.
    pub(crate) fn take_due_changes(&mut self, now: f64) -> (Vec<Intent>, Option<Duration>) {
        let mut changes = Vec::new();
        let mut soonest: Option<Duration> = None;
        for parameter in &mut self.scene.parameters {
            let name = parameter.about.name.clone();
            for (direction, edit) in parameter.edits() {
                match edit.due(now) {
                    Ok(value) => changes.push(Intent::Set {
                        target: Target {
                            name: name.clone(),
                            direction,
                        },
                        value,
                    }),
                    Err(Some(wait)) => soonest = Some(soonest.map_or(wait, |other| other.min(wait))),
                    Err(None) => {}
                }
            }
        }
        (changes, soonest)
    }

    /// What was known of a daemon is void with its connection.
    fn forget(&mut self) {
        self.rig = None;
        self.scene = SceneModel::default();
        self.history.clear();
        self.timing = None;
        self.losses = Losses::default();
        self.refusal = None;
    }

    fn take_description(&mut self, description: Description) {
        self.scene.parameters = description.parameters.into_iter().map(ParameterModel::new).collect();
    }

    fn take_state(&mut self, event: StateEvent) {
        if self.scene.revision.is_none_or(|known| event.revision >= known) {
            if self.scene.revision.is_some_and(|known| known != event.revision) {
                self.scene.tick = Some(event.tick);
            }
            self.scene.revision = Some(event.revision);
            self.scene.advised.overtaken(event.revision);
            self.scene.name = event.scene;
            for (name, value) in &event.params {
                if let Some(parameter) = self.parameter(name) {
                    parameter.take_value(*value);
                }
            }
        }
        self.take_rig(event.state, event.fault, event.tick);
    }

    fn take_rig(&mut self, state: RigState, fault: Option<String>, tick: u64) {
        let known = self.rig.as_ref();
        if known.is_some_and(|known| tick < known.tick) {
            return;
        }
        let is_change = known.is_none_or(|known| known.state != state);
        // An answer carries no reason; the event that follows it does.
        let fault = fault.or_else(|| known.filter(|_| !is_change).and_then(|known| known.fault.clone()));
        // The tick at which the state began, so that a later event in it does not move "stopped at tick".
        let tick = known.filter(|_| !is_change).map_or(tick, |known| known.tick);
        self.rig = Some(Rig { state, fault, tick });
        if is_change {
            self.refusal = None;
        }
        // The force is off after all, whoever took it away.
        if is_halted(state) && matches!(self.stop, StopReport::Failed { .. }) {
            self.stop = StopReport::Settled;
        }
    }

    fn take_answer(&mut self, intent: &Intent, result: Result<Answer, WireError>) {
        match (intent, result) {
            (Intent::Set { target, .. }, result) => {
                let refusal = result.as_ref().err().map(|error| error.message.clone());
                if let Ok(Answer::Changed(reply)) = result {
                    self.take_applied(&reply);
                }
                if let Some(parameter) = self.parameter(&target.name) {
                    parameter.edit(target.direction).answered(refusal);
                }
            }
            (Intent::Stop, result) => self.take_stop_answer(result),
            (_, Ok(Answer::State(StateReply { state, tick }))) => self.take_rig(state, None, tick),
            (_, Ok(Answer::Changed(_))) => {}
            (_, Err(error)) => self.refusal = Some(error.message),
        }
    }

    fn take_stop_answer(&mut self, result: Result<Answer, WireError>) {
        self.stop = match result {
            Ok(Answer::State(StateReply { state, tick })) if is_halted(state) => {
                self.take_rig(state, None, tick);
                StopReport::Settled
            }
            Ok(Answer::State(StateReply { state, .. })) => StopReport::Failed {
                reason: format!("the daemon answered that the rig is {state}"),
            },
            Ok(Answer::Changed(_)) => StopReport::Failed {
                reason: "the daemon's answer is not that to a stop".to_owned(),
            },
            Err(error) => StopReport::Failed { reason: error.message },
        };
    }

    /// Takes an answered change without waiting for the event that follows it, lest the handle jump back meanwhile.
    fn take_applied(&mut self, reply: &ChangeReply) {
        if self.scene.revision.is_some_and(|known| reply.revision < known) {
            return;
        }
        self.scene.revision = Some(reply.revision);
        self.scene.tick = reply.tick;
        self.scene.advised.take_remarks(reply);
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
    }

    fn parameter(&mut self, name: &str) -> Option<&mut ParameterModel> {
        self.scene
            .parameters
            .iter_mut()
            .find(|parameter| parameter.about.name == name)
    }
}

/// Whether a person or a check has taken the force away until a reset.
pub(crate) fn is_halted(state: RigState) -> bool {
    matches!(state, RigState::Stopped | RigState::Faulted)
}
