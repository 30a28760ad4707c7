//! The rig as the control thread sees it: the newest scene, what is sent to the real-time thread,
//! and what comes back.

use tokio::sync::Mutex;
mod commands;
pub(in crate::control) mod commission_record;
mod entries;
pub(crate) mod exclusive_use;
#[cfg(test)]
pub(super) mod fixture;
mod observed_state;
mod outcomes;
mod pump;
pub(crate) mod rig_friction;
mod scenes;
pub(super) mod schedule;
mod stops;
mod waiting_changes;

pub(in crate::control) use commands::Asked;

use crate::control::advise::BrokenBounds;
use crate::control::answer_timer::AnswerTimer;
use crate::control::compile::RampPath;
use crate::control::facts::Facts;
use crate::control::history::History;
use crate::control::journal::Journal;
use crate::control::judge::Verdicts;
use crate::control::leases::Leases;
use crate::control::link_log::LinkLog;
use crate::control::presence::Presence;
use crate::control::rig::commission_record::Records;
use crate::control::rig::exclusive_use::state::ExclusiveUse;
use crate::control::rig::observed_state::ObservedState;
use crate::control::rig::rig_friction::record::RigFrictions;
use crate::control::rig::waiting_changes::Schedule;
use crate::control::worker_pool::WorkerPool;
use crate::rt::clock::now_ns;
use crate::rt::inbox::{RigSetup, Sender};
use crate::rt::outbox::Answers;
use crate::rt::shared::Shared;
use crate::telemetry::feed::Feed;
use haptic_core::Scene;
use haptic_core::limiter::Limits;
use haptic_core::sample_clock::ClockError;
use haptic_ipc::{ErrorCode, ServoSetup, WireError};
use std::cell::{Cell, Ref, RefCell, RefMut};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A ramp to the newest scene.
#[derive(Debug)]
struct Ramp {
    revision: u64,
    path: RampPath,
}

/// Worker threads for the library, and as many for devices.
const MAX_WORKERS: usize = 4;

/// Timeout of an answer from the real-time thread.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Further looks for an answer after the timeout: this thread itself may have been held up, and the
/// real-time thread may not have run since.
const FINAL_CHECKS: u32 = 20;

/// The control thread's handle to the rig. Only one thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct RigHandle {
    pub(crate) facts: Facts,
    shared: Arc<Shared>,
    inbox: RefCell<Sender>,
    /// The newest that was sent.
    sent_setup: Cell<Option<RigSetup>>,
    /// Limits that were sent, until the record of the first tick with them has come.
    sent_limits: Cell<Option<Limits>>,
    reloads: Reloads,
    schedule: RefCell<Schedule>,
    feed: RefCell<Feed>,
    history: RefCell<History>,
    journal: RefCell<Journal>,
    /// The ramp of the newest change, if it has one.
    ramp: RefCell<Option<Ramp>>,
    leases: Leases,
    exclusive_use: RefCell<Option<ExclusiveUse>>,
    records: Records,
    frictions: RigFrictions,
    verdicts: Verdicts,
    broken_bounds: BrokenBounds,
    /// Clients that engage at this moment.
    engaging: Cell<usize>,
    /// The newest tick in which a command to engage was carried out.
    engaged_at: Cell<u64>,
    /// The newest record that the journal has seen.
    observed: Cell<ObservedState>,
    presence: RefCell<Presence>,
    link_log: RefCell<LinkLog>,
    /// Workers that read and write the library.
    library: WorkerPool,
    /// Workers that search for devices.
    devices: WorkerPool,
    clients: Cell<usize>,
    closing: Cell<bool>,
    /// Clients find the socket.
    is_reachable: Cell<bool>,
    serial: Cell<u64>,
    /// One command at a time: the next one waits until it is answered.
    commanding: tokio::sync::Mutex<()>,
}

impl RigHandle {
    pub(crate) fn new(
        facts: Facts,
        shared: Arc<Shared>,
        inbox: Sender,
        feed: Feed,
        scene: Scene,
        revision: u64,
    ) -> Self {
        Self {
            facts,
            shared,
            inbox: RefCell::new(inbox),
            sent_setup: Cell::new(None),
            sent_limits: Cell::new(None),
            reloads: Reloads::default(),
            schedule: RefCell::default(),
            feed: RefCell::new(feed),
            history: RefCell::new(History::new(revision, Rc::new(scene))),
            journal: RefCell::new(Journal::default()),
            ramp: RefCell::new(None),
            leases: Leases::default(),
            exclusive_use: RefCell::new(None),
            records: Records::default(),
            frictions: RigFrictions::default(),
            verdicts: Verdicts::default(),
            broken_bounds: BrokenBounds::default(),
            engaging: Cell::new(0),
            engaged_at: Cell::new(0),
            observed: Cell::new(ObservedState::default()),
            presence: RefCell::default(),
            link_log: RefCell::default(),
            library: WorkerPool::new("library", MAX_WORKERS),
            devices: WorkerPool::new("devices", MAX_WORKERS),
            clients: Cell::new(0),
            closing: Cell::new(false),
            is_reachable: Cell::new(true),
            serial: Cell::new(0),
            commanding: tokio::sync::Mutex::new(()),
        }
    }

    /// The settings that the loop's servo has, or will have with the command to engage that was sent;
    /// `None` while the device is not connected, whose resolution and limit are among them.
    pub(crate) fn servo_in_use(&self) -> Option<ServoSetup> {
        let settings = self.facts.servo.get();
        let begun_with = RigSetup {
            losses: settings.losses,
            compensation: settings.compensation,
        };
        self.facts
            .is_device_known()
            .then(|| self.facts.servo_setup(self.sent_setup.get().unwrap_or(begun_with)))
    }

    /// The newest scene; it may still be on its way to the real-time thread.
    pub(crate) fn scene(&self) -> Ref<'_, Rc<Scene>> {
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

    /// Workers that read and write the library.
    pub(super) fn library(&self) -> &WorkerPool {
        &self.library
    }

    /// Workers that search for devices.
    pub(super) fn devices(&self) -> &WorkerPool {
        &self.devices
    }

    /// Why the newest reload was refused, if it was.
    pub(crate) fn refused_reload(&self) -> Ref<'_, Option<String>> {
        self.reloads.refusal.borrow()
    }

    pub(in crate::control) fn reloads(&self) -> &Reloads {
        &self.reloads
    }

    pub(crate) fn leases(&self) -> &Leases {
        &self.leases
    }

    pub(super) fn exclusive_use(&self) -> &RefCell<Option<ExclusiveUse>> {
        &self.exclusive_use
    }

    pub(super) fn records(&self) -> &Records {
        &self.records
    }

    /// What was identified of rigs.
    pub(super) fn frictions(&self) -> &RigFrictions {
        &self.frictions
    }

    /// Whether scenes chatter on the rig, as far as they were tried.
    pub(super) fn verdicts(&self) -> &Verdicts {
        &self.verdicts
    }

    /// The bounds that the active scene broke, as they were last reckoned.
    pub(super) fn broken_bounds(&self) -> &BrokenBounds {
        &self.broken_bounds
    }

    /// Sets the time at which the real-time thread releases the rig, unless it is postponed.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.shared.lease_until(until_ns);
    }

    /// Begins the end of the daemon: the rig can be released, but no longer engaged.
    pub(crate) fn close(&self) {
        self.closing.set(true);
    }

    pub(crate) fn clients(&self) -> &Cell<usize> {
        &self.clients
    }

    /// A function that ends the loop with zero force, from any thread, also while this one hangs.
    pub(crate) fn end_of_loop(&self) -> impl Fn() + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move || shared.quit()
    }

    /// Tells the real-time thread that the caller, the thread that hears stops, is alive.
    pub(crate) fn heartbeat(&self) {
        if self.is_reachable.get() {
            self.shared.heartbeat(now_ns());
        }
    }

    /// Tells whether a client can reach the daemon to stop the rig. Where none can, that is as if the thread that hears
    /// stops were dead.
    pub(crate) fn set_reachable(&self, is_reachable: bool) {
        self.is_reachable.set(is_reachable);
        if !is_reachable {
            self.shared.heartbeat(0);
        }
    }

    /// What is wrong with the device's clock, for who wants to engage.
    pub(crate) fn clock_error(&self) -> Option<ClockError> {
        self.feed().newest().and_then(|record| record.clock_error)
    }

    /// Exchanges with the real-time thread what waits on both sides; returns what it has answered so far.
    fn answers(&self) -> Answers {
        self.inbox.borrow_mut().flush();
        let mut feed = self.feed.borrow_mut();
        feed.take_records();
        feed.answers()
    }

    /// Waits for an answer of the real-time thread.
    ///
    /// # Errors
    /// The real-time thread does not answer in time.
    async fn answer<T>(&self, answered: impl Fn(Answers) -> Option<T>) -> Result<T, WireError> {
        let asked = Instant::now();
        let mut final_checks = FINAL_CHECKS;
        let mut timer = AnswerTimer::new(
            self.facts.period_ns,
            self.feed.borrow().newest().map(|record| record.deadline_ns),
        );
        loop {
            if let Some(answer) = answered(self.answers()) {
                return Ok(answer);
            }
            let is_late = asked.elapsed() > ANSWER_TIMEOUT;
            if is_late && final_checks == 0 {
                return Err(WireError::new(
                    ErrorCode::NotResponding,
                    format!(
                        "the real-time thread has not answered for {} ms; cut the power of the motor if it still pulls",
                        ANSWER_TIMEOUT.as_millis()
                    ),
                ));
            }
            final_checks -= u32::from(is_late);
            // The real-time thread wakes no other: that would be a system call.
            timer.next().await;
        }
    }
}

/// What is kept of reloads.
#[derive(Debug, Default)]
pub(in crate::control) struct Reloads {
    /// One at a time.
    pub(in crate::control) turn: Arc<Mutex<()>>,
    /// Why the newest one was refused, if it was.
    pub(in crate::control) refusal: RefCell<Option<String>>,
}
