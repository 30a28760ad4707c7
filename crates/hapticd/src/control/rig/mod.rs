//! The rig as the control thread sees it: the newest scene, the way to the real-time thread, and
//! what comes back.

mod commands;
mod entries;
mod scenes;
mod seen;
mod stops;

use crate::control::aside::Aside;
use crate::control::commission::record::Records;
use crate::control::commission::state::Commissioning;
use crate::control::compile::RampPath;
use crate::control::facts::Facts;
use crate::control::history::History;
use crate::control::journal::Journal;
use crate::control::leases::Leases;
use crate::control::presence::Presence;
use crate::control::pulse::Pulse;
use crate::control::rig::seen::ObservedState;
use crate::rt::clock::now_ns;
use crate::rt::handoff::Shared;
use crate::telemetry::feed::Feed;
use haptic_core::Scene;
use haptic_ipc::{ErrorCode, RigState, WireError};
use std::cell::{Cell, Ref, RefCell, RefMut};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The way to the newest scene, where it takes some time.
#[derive(Debug)]
struct Ramp {
    revision: u64,
    way: RampPath,
}

/// Threads that may wait for the library at once, and as many for devices.
const MOST_ASIDE: usize = 4;

/// How long an answer from the real-time thread may take.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Looks for an answer after that: this thread may have been held up itself, and the other not have
/// run since.
const LAST_LOOKS: u32 = 20;

/// The control thread's hold on the rig. One thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct RigHandle {
    pub(crate) facts: Facts,
    shared: Arc<Shared>,
    feed: RefCell<Feed>,
    history: RefCell<History>,
    journal: RefCell<Journal>,
    /// The way from one scene to another on which the newest change is.
    ramp: RefCell<Option<Ramp>>,
    leases: Leases,
    commissioning: RefCell<Option<Commissioning>>,
    records: Records,
    /// The newest record, as far as the journal was told of it.
    seen: Cell<ObservedState>,
    presence: RefCell<Presence>,
    /// Where the library is read and written.
    library: Aside,
    /// Where devices are looked for.
    devices: Aside,
    clients: Cell<usize>,
    closing: Cell<bool>,
    serial: Cell<u32>,
    /// The command word holds one command: the next waits until it is answered.
    commanding: tokio::sync::Mutex<()>,
}

impl RigHandle {
    pub(crate) fn new(facts: Facts, shared: Arc<Shared>, feed: Feed, scene: Scene, revision: u64) -> Self {
        Self {
            facts,
            shared,
            feed: RefCell::new(feed),
            history: RefCell::new(History::new(revision, scene)),
            journal: RefCell::new(Journal::default()),
            ramp: RefCell::new(None),
            leases: Leases::default(),
            commissioning: RefCell::new(None),
            records: Records::default(),
            seen: Cell::new(ObservedState::default()),
            presence: RefCell::default(),
            library: Aside::new("library", MOST_ASIDE),
            devices: Aside::new("devices", MOST_ASIDE),
            clients: Cell::new(0),
            closing: Cell::new(false),
            serial: Cell::new(0),
            commanding: tokio::sync::Mutex::new(()),
        }
    }

    /// Moves telemetry on, and frees what the real-time thread gave back.
    pub(crate) fn pump(&self) {
        let changes = {
            let mut feed = self.feed.borrow_mut();
            feed.stops_ended(&self.shared.answers);
            feed.pump(self.history.borrow().scenes())
        };
        self.keep_journal(&changes);
    }

    /// The feed, with everything taken in that the loop has left: what was answered is also to be
    /// seen.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.pump();
        self.feed.borrow_mut()
    }

    /// The newest scene; it may still be on its way to the real-time thread.
    pub(crate) fn scene(&self) -> Ref<'_, Scene> {
        Ref::map(self.history.borrow(), |history| &history.newest().scene)
    }

    /// Revision of the newest scene.
    pub(crate) fn revision(&self) -> u64 {
        self.history.borrow().newest().revision
    }

    pub(crate) fn history(&self) -> Ref<'_, History> {
        self.history.borrow()
    }

    pub(crate) fn history_mut(&self) -> RefMut<'_, History> {
        self.history.borrow_mut()
    }

    /// Where the library is read and written.
    pub(super) fn library(&self) -> &Aside {
        &self.library
    }

    /// Where devices are looked for.
    pub(super) fn devices(&self) -> &Aside {
        &self.devices
    }

    pub(crate) fn leases(&self) -> &Leases {
        &self.leases
    }

    pub(super) fn commissioning(&self) -> &RefCell<Option<Commissioning>> {
        &self.commissioning
    }

    pub(super) fn records(&self) -> &Records {
        &self.records
    }

    /// The state of the rig while no command is on its way, which is kept so as long as the first
    /// of the two is.
    pub(super) async fn quiet_state(&self) -> (tokio::sync::MutexGuard<'_, ()>, RigState) {
        let turn = self.commanding.lock().await;
        (turn, self.state())
    }

    /// State of the rig in its newest record.
    pub(crate) fn state(&self) -> RigState {
        let feed = self.feed();
        match feed.newest() {
            Some(record) => record.state,
            None if feed.link().is_some() => RigState::Disconnected,
            None => RigState::Idle,
        }
    }

    /// Sets the time at which the real-time thread releases the rig, unless it is moved on.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.shared.lease_until(until_ns);
    }

    /// From now on the daemon ends: the rig may be released, and not engaged.
    pub(crate) fn close(&self) {
        self.closing.set(true);
    }

    pub(crate) fn clients(&self) -> &Cell<usize> {
        &self.clients
    }

    /// What ends the loop with zero force, from whichever thread, also while this one hangs.
    pub(crate) fn end_of_loop(&self) -> impl Fn() + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move || shared.quit()
    }

    /// The beat for the real-time thread: the caller is the thread that hears stops.
    pub(crate) fn beat(&self) {
        self.shared.beat(now_ns());
    }

    /// Samples that were not rendered, because no hand can have made them.
    pub(crate) fn samples_forgotten(&self) -> u64 {
        self.shared.answers.samples_forgotten()
    }

    /// Waits for the real-time thread.
    ///
    /// # Errors
    /// It does not answer in time.
    async fn answer<T>(&self, answered: impl Fn(&Shared) -> Option<T>) -> Result<T, WireError> {
        let asked = Instant::now();
        let mut last_looks = LAST_LOOKS;
        let mut pulse = Pulse::new(
            self.facts.period_ns,
            self.feed.borrow().newest().map(|record| record.deadline_ns),
        );
        loop {
            if let Some(answer) = answered(&self.shared) {
                return Ok(answer);
            }
            let is_late = asked.elapsed() > ANSWER_TIMEOUT;
            if is_late && last_looks == 0 {
                return Err(WireError::new(
                    ErrorCode::NotResponding,
                    format!(
                        "the real-time thread has not answered for {} ms; cut the power of the motor if it still pulls",
                        ANSWER_TIMEOUT.as_millis()
                    ),
                ));
            }
            last_looks -= u32::from(is_late);
            // The real-time thread wakes no other: that would be a system call.
            pulse.next().await;
        }
    }
}
