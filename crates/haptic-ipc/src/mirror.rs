//! What a client knows of the daemon: the newest of each thing that the daemon has stated.

use crate::describe::{Description, ParameterDescription};
use crate::event::{Event, StateEvent, SubscribeReply};
use crate::journal::JournalEntry;
use crate::replay::ServoSetup;
use crate::scene::{ChangeReply, ListedScene, SceneReply};
use crate::status::{RigState, StateReply, Status};
use crate::timing::Timing;
use haptic_core::{Directional, Scene};
use std::collections::VecDeque;

/// Entries of the journal that are kept.
const MAX_ENTRIES: usize = 50;

/// The daemon as it last described itself. The mirror takes the greeting, the answers and the events in the order in
/// which they come. A statement that is older than what is known changes nothing. All facts stay when the connection
/// is lost, to be shown as what they were; the next connection begins without any.
#[derive(Clone, Debug, Default)]
pub struct DaemonMirror {
    is_connected: bool,
    /// Name and version of the server.
    pub server: String,
    /// Samples a second that are subscribed to, Hz.
    pub rate_hz: Option<f64>,
    /// What the samples are computed with.
    pub servo: Option<ServoSetup>,
    /// The newest answer to `status`.
    pub status: Option<Box<Status>>,
    /// The newest report of the loop's timing.
    pub timing: Option<Box<Timing>>,
    /// The active scene.
    pub scene: SceneMirror,
    /// The newest changes and who made them, newest last.
    pub journal: VecDeque<JournalEntry>,
    /// The daemon's library of scenes.
    pub library: Vec<ListedScene>,
    /// Rows of samples that the daemon could not send.
    pub lost_rows: u64,
    rig: Option<RigMirror>,
}

/// The rig, as the daemon last described it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RigMirror {
    /// Its state.
    pub state: RigState,
    /// Why it is faulted.
    pub fault: Option<String>,
    /// The tick at which the state began, or a later one.
    pub tick: u64,
    /// Whether it is the tick at which it began: the client had received another state before.
    pub is_begin_seen: bool,
}

/// The active scene, as the daemon last described it.
#[derive(Clone, Debug, Default)]
pub struct SceneMirror {
    /// Its name.
    pub name: String,
    /// Its friction law.
    pub law: String,
    /// The rows of the parameter table, with the active values.
    pub parameters: Vec<ParameterDescription>,
    /// Its revision.
    pub revision: Option<u64>,
    /// The tick that applied it, unless it was active before the client listened.
    pub tick: Option<u64>,
    /// The newest whole scene, which may be one of an earlier revision; see [`DaemonMirror::active_scene`].
    pub whole: Option<Scene>,
    /// Number of changes that `undo` can undo.
    pub undo_depth: usize,
    /// Number of changes that `redo` can redo.
    pub redo_depth: usize,
    whole_revision: Option<u64>,
    /// Law and parameters by the newest event.
    shape: Option<SceneShape>,
}

/// What decides the rows of the parameter table: the law and the names of the parameters.
pub type SceneShape = (String, Vec<String>);

/// What a statement has changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MirrorChange {
    /// A state of the rig that is not older than the known one.
    pub rig: Option<RigChange>,
    /// There is another scene: remarks on the one before are void.
    pub is_new_revision: bool,
    /// Names of the parameters that have other values.
    pub parameters: Vec<String>,
}

/// A state of the rig that the daemon has stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RigChange {
    /// The known state before.
    pub before: Option<RigState>,
    /// The state.
    pub now: RigState,
    /// The tick of the statement.
    pub tick: u64,
}

impl DaemonMirror {
    /// A daemon has greeted, whose name and version are `server`: nothing else is known of it.
    pub fn connect(&mut self, server: &str) {
        *self = Self {
            is_connected: true,
            server: server.to_owned(),
            ..Self::default()
        };
    }

    /// The connection is lost: every fact is old.
    pub fn disconnect(&mut self) {
        self.is_connected = false;
    }

    /// Whether the daemon states what it does.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.is_connected
    }

    /// The rig, while the daemon states what it does.
    #[must_use]
    pub fn rig(&self) -> Option<&RigMirror> {
        self.rig.as_ref().filter(|_| self.is_connected)
    }

    /// The rig, now or when the connection was lost.
    #[must_use]
    pub fn last_rig(&self) -> Option<&RigMirror> {
        self.rig.as_ref()
    }

    /// Revision of the active scene, while the daemon states it.
    #[must_use]
    pub fn revision(&self) -> Option<u64> {
        self.scene.revision.filter(|_| self.is_connected)
    }

    /// The whole active scene; `None` while only that of an earlier revision is known.
    #[must_use]
    pub fn active_scene(&self) -> Option<&Scene> {
        let is_of = self.revision().is_some() && self.scene.whole_revision == self.revision();
        self.scene.whole.as_ref().filter(|_| is_of)
    }

    /// Whether there is a block, as far as is known.
    #[must_use]
    pub fn has_block(&self) -> bool {
        self.scene.whole.as_ref().is_none_or(|scene| scene.block.is_some())
    }

    /// Takes the answer to `subscribe`.
    pub fn take_subscription(&mut self, reply: &SubscribeReply) {
        self.rate_hz = Some(reply.rate_hz);
        self.servo.clone_from(&reply.servo);
    }

    /// Takes the answer to `describe`.
    pub fn take_description(&mut self, description: Description) -> MirrorChange {
        let known = std::mem::replace(&mut self.scene.parameters, description.parameters);
        self.scene.law = description.law;
        let is_other = |about: &&ParameterDescription| {
            let mut known = known.iter();
            known.any(|known| known.name == about.name && known.value != about.value)
        };
        let parameters = self.scene.parameters.iter().filter(is_other);
        MirrorChange {
            parameters: parameters.map(|about| about.name.clone()).collect(),
            ..MirrorChange::default()
        }
    }

    /// Takes the answer to `get` for the active scene.
    pub fn take_scene(&mut self, reply: SceneReply) {
        if !self.scene.is_older(reply.revision) {
            self.scene.whole_revision = Some(reply.revision);
            self.scene.whole = Some(reply.scene);
        }
    }

    /// Takes the answer to a change without waiting for the event after it: otherwise a slider would jump back
    /// meanwhile.
    pub fn take_change(&mut self, reply: &ChangeReply) -> MirrorChange {
        let scene = &mut self.scene;
        if reply.dry_run || scene.is_older(reply.revision) {
            return MirrorChange::default();
        }
        let mut change = scene.take_revision(reply.revision);
        scene.tick = reply.tick.or(scene.tick);
        for (key, &value) in &reply.applied {
            let name = key.trim_end_matches(['+', '-']);
            let changed = |before: Directional| Directional {
                positive: if key.ends_with('-') { before.positive } else { value },
                negative: if key.ends_with('+') { before.negative } else { value },
            };
            scene.take_value(name, changed, &mut change);
        }
        change
    }

    /// Takes the answer to `engage`, `release`, `stop` or `reset`.
    pub fn take_state(&mut self, reply: &StateReply) -> MirrorChange {
        MirrorChange {
            rig: self.take_rig(reply.state, None, reply.tick),
            ..MirrorChange::default()
        }
    }

    /// Takes the answer to `log`: the entries before those that were received.
    pub fn take_journal(&mut self, older: Vec<JournalEntry>) {
        let newer = std::mem::take(&mut self.journal);
        for entry in older.into_iter().chain(newer) {
            self.take_entry(entry);
        }
    }

    /// Takes an event.
    pub fn take_event(&mut self, event: &Event) -> MirrorChange {
        match event {
            Event::State(event) => return self.take_state_event(event),
            Event::Servo(event) => self.servo = Some(event.servo.clone()),
            Event::Timing(timing) => self.timing = Some(timing.clone()),
            Event::Samples(batch) => self.lost_rows = self.lost_rows.saturating_add(batch.dropped),
            Event::Log(entry) => self.take_entry((**entry).clone()),
            Event::Snapshot(_) | Event::Unknown => {}
        }
        MirrorChange::default()
    }

    fn take_state_event(&mut self, event: &StateEvent) -> MirrorChange {
        let mut change = self.scene.take_state(event);
        change.rig = self.take_rig(event.state, event.fault.clone(), event.tick);
        change
    }

    fn take_rig(&mut self, state: RigState, fault: Option<String>, tick: u64) -> Option<RigChange> {
        let known = self.rig.as_ref();
        if known.is_some_and(|known| tick < known.tick) {
            return None;
        }
        let before = known.map(|known| known.state);
        // An answer has no reason of a fault, the event after it has. A later statement does not move the beginning of
        // the state.
        let (fault, begun, is_begin_seen) = match known.filter(|known| known.state == state) {
            Some(known) => (fault.or_else(|| known.fault.clone()), known.tick, known.is_begin_seen),
            None => (fault, tick, known.is_some()),
        };
        let now = state;
        self.rig = Some(RigMirror {
            state,
            fault,
            tick: begun,
            is_begin_seen,
        });
        Some(RigChange { before, now, tick })
    }

    fn take_entry(&mut self, entry: JournalEntry) {
        // The newest entry of the answer and the first event may be the same.
        if self.journal.back().is_some_and(|last| last.seq >= entry.seq) {
            return;
        }
        self.journal.push_back(entry);
        while self.journal.len() > MAX_ENTRIES {
            self.journal.pop_front();
        }
    }
}

impl SceneMirror {
    /// What decides the rows of the parameter table, by the newest event.
    #[must_use]
    pub fn shape(&self) -> Option<&SceneShape> {
        self.shape.as_ref()
    }

    fn is_older(&self, revision: u64) -> bool {
        self.revision.is_some_and(|known| revision < known)
    }

    fn take_revision(&mut self, revision: u64) -> MirrorChange {
        MirrorChange {
            is_new_revision: self.revision.replace(revision) != Some(revision),
            ..MirrorChange::default()
        }
    }

    fn take_state(&mut self, event: &StateEvent) -> MirrorChange {
        (self.undo_depth, self.redo_depth) = (event.undo_depth, event.redo_depth);
        if self.is_older(event.revision) {
            return MirrorChange::default();
        }
        if self.revision.is_some_and(|known| known != event.revision) {
            self.tick = Some(event.tick);
        }
        let mut change = self.take_revision(event.revision);
        self.name.clone_from(&event.scene);
        if !event.law.is_empty() {
            self.law.clone_from(&event.law);
        }
        self.shape = Some((event.law.clone(), event.params.keys().cloned().collect()));
        for (name, &value) in &event.params {
            self.take_value(name, |_| value, &mut change);
        }
        change
    }

    fn take_value(&mut self, name: &str, value: impl Fn(Directional) -> Directional, change: &mut MirrorChange) {
        let mut parameters = self.parameters.iter_mut();
        let Some(about) = parameters.find(|about| about.name == name) else {
            return;
        };
        let value = value(about.value);
        if about.value != value {
            about.value = value;
            change.parameters.push(name.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(state: RigState, fault: Option<&str>, tick: u64, revision: u64) -> Event {
        let mut event = StateEvent {
            state,
            fault: fault.map(ToOwned::to_owned),
            tick,
            revision,
            scene: format!("scene {revision}"),
            law: "karnopp".into(),
            params: crate::params_of(&Scene::paper()),
            ..StateEvent::default()
        };
        let value = 4.0 + f64::from(u32::try_from(revision).expect("small"));
        event.params.insert("static_force".into(), Directional::both(value));
        Event::State(event)
    }

    fn connected() -> DaemonMirror {
        let mut mirror = DaemonMirror::default();
        mirror.connect("hapticd");
        mirror
    }

    #[test]
    fn an_older_state_or_revision_changes_nothing() {
        let mut mirror = connected();
        mirror.take_event(&state(RigState::Engaged, None, 9, 7));
        let change = mirror.take_event(&state(RigState::Idle, None, 8, 6));
        assert_eq!(change, MirrorChange::default());
        let rig = mirror.rig().expect("a rig");
        assert_eq!((rig.state, rig.tick), (RigState::Engaged, 9));
        assert_eq!(mirror.revision(), Some(7));
        assert_eq!(mirror.scene.name, "scene 7");
    }

    #[test]
    fn a_fault_keeps_its_reason_and_its_first_tick() {
        let mut mirror = connected();
        let answer = |state, tick| StateReply { state, tick };
        mirror.take_event(&state(RigState::Engaged, None, 1, 1));
        mirror.take_state(&answer(RigState::Faulted, 5));
        mirror.take_event(&state(RigState::Faulted, Some("no sample"), 5, 1));
        let change = mirror.take_state(&answer(RigState::Faulted, 9));
        let (before, now) = (Some(RigState::Faulted), RigState::Faulted);
        assert_eq!(change.rig, Some(RigChange { before, now, tick: 9 }));
        let rig = mirror.rig().expect("a rig");
        assert_eq!((rig.fault.as_deref(), rig.tick), (Some("no sample"), 5));
        assert!(rig.is_begin_seen);
        // Who comes later has not seen it begin.
        let mut later = connected();
        later.take_event(&state(RigState::Faulted, Some("no sample"), 9, 1));
        later.take_event(&state(RigState::Faulted, Some("no sample"), 10, 1));
        assert!(!later.rig().expect("a rig").is_begin_seen);
    }

    #[test]
    fn facts_of_a_lost_connection_are_old_and_of_the_next_unknown() {
        let mut mirror = connected();
        mirror.take_event(&state(RigState::Engaged, None, 9, 7));
        let scene = |revision| SceneReply {
            revision,
            params: std::collections::BTreeMap::new(),
            scene: Scene::paper(),
        };
        mirror.take_scene(scene(6));
        assert!(mirror.scene.whole.is_none(), "it is older");
        mirror.take_scene(scene(7));
        assert!(mirror.active_scene().is_some());
        mirror.take_event(&state(RigState::Engaged, None, 10, 8));
        assert!(mirror.active_scene().is_none(), "another scene is active");
        mirror.disconnect();
        assert!(mirror.rig().is_none() && mirror.revision().is_none());
        assert!(mirror.last_rig().is_some() && mirror.scene.revision.is_some());
        mirror.connect("hapticd");
        assert!(mirror.last_rig().is_none() && mirror.scene.revision.is_none());
    }

    #[test]
    fn values_come_from_events_and_answers() {
        let mut mirror = connected();
        mirror.take_description(Description::of(&Scene::paper()));
        let change = mirror.take_event(&state(RigState::Idle, None, 1, 1));
        assert!(change.is_new_revision);
        assert_eq!(change.parameters, ["static_force"]);
        let mut reply: ChangeReply = serde_json::from_str(
            r#"{"revision":2,"changed":true,"tick":5,"applied":{"static_force-":6},"changes":[],"advice":[]}"#,
        )
        .expect("an answer");
        let change = mirror.take_change(&reply);
        assert_eq!((change.is_new_revision, mirror.scene.tick), (true, Some(5)));
        let value = |mirror: &DaemonMirror| {
            let mut rows = mirror.scene.parameters.iter();
            let row = rows.find(|row| row.name == "static_force");
            row.map(|row| (row.value.positive, row.value.negative))
        };
        assert_eq!(value(&mirror), Some((5.0, 6.0)));
        (reply.revision, reply.dry_run) = (3, true);
        assert_eq!(mirror.take_change(&reply), MirrorChange::default());
        (reply.revision, reply.dry_run) = (1, false);
        assert_eq!(mirror.take_change(&reply), MirrorChange::default(), "it is older");
    }

    #[test]
    fn journal_has_each_entry_once() {
        let mut mirror = connected();
        let entry = |seq| JournalEntry {
            seq,
            ..JournalEntry::of("set")
        };
        mirror.take_event(&Event::Log(Box::new(entry(3))));
        mirror.take_journal((1..=3).map(entry).collect());
        let seqs: Vec<u64> = mirror.journal.iter().map(|entry| entry.seq).collect();
        assert_eq!(seqs, [1, 2, 3]);
        mirror.take_journal(Vec::new());
        mirror.take_event(&Event::Log(Box::new(entry(100))));
        assert_eq!(mirror.journal.len(), 4);
    }
}
