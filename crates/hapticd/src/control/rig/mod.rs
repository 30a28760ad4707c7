//! The rig as the control thread sees it: the newest scene, what is sent to the real-time thread,
//! and what comes back.

pub(in crate::control) mod both_motors;
mod commands;
pub(in crate::control) mod commission_record;
mod entries;
pub(crate) mod exclusive_use;
#[cfg(test)]
pub(super) mod fixture;
pub(in crate::control) mod friction_record;
pub(crate) mod known_rig;
pub(crate) mod loop_channel;
mod scenes;
pub(super) mod schedule;

pub(in crate::control) use commands::{Asked, ReadAfter, refused_in};
pub(in crate::control) use known_rig::Suited;
pub(in crate::control) use scenes::Compiled;

use crate::control::facts::Facts;
use crate::control::history::{FIRST_REVISION, History};
use crate::control::journal::Completion;
use crate::control::lease::Leases;
use crate::control::library::Library;
use crate::control::reload::Reloads;
use crate::control::rig::entries::RigJournal;
use crate::control::rig::exclusive_use::ExclusiveUse;
use crate::control::rig::known_rig::KnownRig;
use crate::control::rig::loop_channel::LoopChannel;
use crate::control::rig::schedule::Schedule;
use crate::rt::handoff::ControlSide;
use crate::rt::outbox::{Answers, TickRecord};
use crate::telemetry::feed::Feed;
use haptic_core::Scene;
use haptic_core::servo::Fault;
use haptic_ipc::{Event, JournalEntry, LogReply, Peer, StateReply, Topic, WireError};
use std::cell::{Cell, Ref, RefCell, RefMut};
use std::rc::Rc;

/// The control thread's handle to the rig. Only one thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct RigHandle {
    pub(crate) facts: Rc<Facts>,
    pub(crate) channel: LoopChannel,
    pub(in crate::control) known: KnownRig,
    history: RefCell<History>,
    schedule: RefCell<Schedule>,
    journal: RefCell<RigJournal>,
    pub(crate) leases: Leases,
    pub(in crate::control) exclusive_use: RefCell<Option<ExclusiveUse>>,
    pub(in crate::control) library: Library,
    pub(crate) reloads: Reloads,
    /// Clients that are connected.
    pub(crate) clients: Cell<usize>,
}

impl RigHandle {
    pub(crate) fn new(facts: Facts, control: ControlSide, scene: Scene) -> Self {
        let facts = Rc::new(facts);
        Self {
            channel: LoopChannel::new(control, &facts),
            known: KnownRig::new(Rc::clone(&facts)),
            history: RefCell::new(History::new(FIRST_REVISION, Rc::new(scene))),
            schedule: RefCell::default(),
            journal: RefCell::default(),
            leases: Leases::default(),
            exclusive_use: RefCell::default(),
            library: Library::new(facts.scene_dir.clone()),
            reloads: Reloads::default(),
            clients: Cell::default(),
            facts,
        }
    }

    /// Takes the records of the loop so far into the feed, the history and the journal, and sends what waits. The
    /// caller holds none of them.
    pub(crate) fn pump(&self) {
        self.channel.exchange();
        // After the records: every scene that they name is in the history then.
        self.settle_schedule();
        let changes = self.channel.distribute(&self.facts, self.history().scenes());
        self.keep_journal(&changes);
    }

    /// Waits for an answer of the real-time thread.
    ///
    /// # Errors
    /// The real-time thread does not answer in time.
    async fn answer<T>(&self, answered: impl Fn(Answers) -> Option<T>) -> Result<T, WireError> {
        let mut looks = self.channel.looks(self.facts.period_ns);
        loop {
            if let Some(answer) = answered(self.channel.exchange()) {
                return Ok(answer);
            }
            looks.next().await?;
        }
    }

    /// What the records have brought, as of the last [`pump`](Self::pump).
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.channel.feed()
    }

    /// The newest scene; it may still be on its way to the real-time thread.
    pub(crate) fn scene(&self) -> Ref<'_, Rc<Scene>> {
        Ref::map(self.history(), |history| &history.newest().scene)
    }

    /// Revision of the newest scene.
    pub(crate) fn revision(&self) -> u64 {
        self.history().newest().revision
    }

    pub(in crate::control) fn history(&self) -> Ref<'_, History> {
        self.history.borrow()
    }

    pub(in crate::control) fn history_mut(&self) -> RefMut<'_, History> {
        self.history.borrow_mut()
    }

    /// The changes that wait for their tick.
    pub(in crate::control) fn schedule(&self) -> Ref<'_, Schedule> {
        self.schedule.borrow()
    }

    /// Enters an entry into the journal, at the newest revision.
    pub(crate) fn enter(&self, until: Completion, entry: JournalEntry) {
        let revision = self.revision();
        let entry = JournalEntry { revision, ..entry };
        self.journal.borrow_mut().entries.enter(until, entry);
    }

    /// Enters what was done, for whom if a client asked for it, and a message.
    pub(in crate::control) fn enter_done(&self, op: &str, by: Option<&Peer>, message: Option<String>) {
        let entry = JournalEntry {
            by: by.cloned(),
            message,
            ..JournalEntry::of(op)
        };
        self.enter(Completion::Done, entry);
    }

    /// The state of the newest record, for an answer.
    pub(in crate::control) fn state_reply(&self) -> StateReply {
        let feed = self.feed();
        StateReply {
            state: feed.state(),
            tick: feed.newest().map_or(0, |record| record.tick),
        }
    }

    /// Completes the journal by the records of changes, and sends its new entries to the subscribers.
    fn keep_journal(&self, changes: &[TickRecord]) {
        let (feed, revision) = (self.feed(), self.revision());
        let mut journal = self.journal.borrow_mut();
        for entry in journal.completed(&self.facts, revision, changes, feed.answers()) {
            feed.subscribers
                .broadcast(Topic::Log, || Event::Log(Box::new(entry.clone())));
        }
    }

    /// The newest entries of the journal.
    pub(in crate::control) fn journal(&self, after: u64, limit: usize) -> LogReply {
        self.journal.borrow().entries.entries(after, limit)
    }

    /// Times that each fault, or the rig's stop button, took the force away, by its code; also those that never did.
    pub(crate) fn faults(&self) -> [(&'static str, u64); Fault::KINDS.len()] {
        self.journal.borrow().entries.faults()
    }

    /// Writes to the log what is due about the link. It is looked at for that now and then, not with every request.
    pub(crate) fn log_link(&self) {
        if let Some(link) = &self.facts.link {
            self.journal.borrow_mut().log_link(link);
        }
    }
}
