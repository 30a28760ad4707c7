//! The rig as the control thread sees it: the newest scene, the way to the real-time thread, and what comes back.

use crate::control::admission::{self, Admission, EngageRules, Purpose};
use crate::control::aside::Aside;
use crate::control::commission::record::Records;
use crate::control::commission::{self, Commissioning};
use crate::control::compile::{Compiled, Way};
use crate::control::connected::Device;
use crate::control::history::{History, Move};
use crate::control::journal::{Journal, Until};
use crate::control::lease::Leases;
use crate::control::presence::{self, Presence};
use crate::control::pulse::Pulse;
use crate::processor_share::ProcessorShare;
use crate::rt::clock::now_ns;
use crate::rt::handoff::{Heard, Outcome, Shared, Stopped};
use crate::rt::outbox::TickRecord;
use crate::telemetry::feed::Feed;
use crate::telemetry::link;
use device_boards::Address;
use device_io::link::{LinkMonitor, LinkState, RunningKeeper};
use haptic_core::adviser::RigFacts;
use haptic_core::limiter::Limits;
use haptic_core::servo::{Command, CompiledScene, Fault};
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::{
    AdviceBasis, ErrorCode, ForceLimitBy, JournalEntry, LogReply, Peer, RealTimeStatus, RigState, StateChange,
    WireError,
};
use std::cell::{Cell, Ref, RefCell, RefMut};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What does not change while the daemon runs.
#[derive(Debug)]
pub(crate) struct Facts {
    pub(crate) server: String,
    pub(crate) device: String,
    pub(crate) address: Address,
    pub(crate) limits: Limits,
    /// Keeps the processors awake as long as it is open.
    pub(crate) _awake: Option<std::fs::File>,
    /// The loop's share of its processor, where it is pinned to one.
    pub(crate) share: Option<ProcessorShare>,
    pub(crate) rig: RigFacts,
    /// The link to the rig, where it is not in this process.
    pub(crate) link: Option<LinkMonitor>,
    /// Looks after that link as long as it is here.
    pub(crate) keeper: Option<RunningKeeper>,
    pub(crate) period_ns: u64,
    /// Time that engaging and releasing take.
    pub(crate) ramp: Duration,
    /// What is put up with of a device.
    pub(crate) rules: EngageRules,
    /// Where it is kept what was found of rigs.
    pub(crate) state_dir: PathBuf,
    pub(crate) scheme: Scheme,
    pub(crate) velocity: Method,
    /// Where saved scenes are.
    pub(crate) scene_dir: PathBuf,
    /// As it was when the loop began.
    pub(crate) real_time: RealTimeStatus,
}

impl Facts {
    /// What the adviser goes by: with a link, resolution and rate are those of the device that is connected, and the delay is what was measured of it.
    pub(crate) fn rig_facts(&self) -> RigFacts {
        let Some(link) = &self.link else { return self.rig };
        let mut times = link::times(link);
        let mut rig = self.rig;
        if let LinkState::Connected { device, .. } = link.state() {
            rig.resolution = device.resolution_m;
            times.sample_period_s = 1.0 / device.sample_rate_hz;
        }
        rig.sample_period_s = times.sample_period_s;
        rig.delay_s = times.delay_s(rig.period_s);
        rig
    }

    /// What the adviser goes by, for people.
    pub(crate) fn advice_basis(&self) -> AdviceBasis {
        let rig = self.rig_facts();
        AdviceBasis {
            period_us: rig.period_s * 1e6,
            sample_period_us: (rig.sample_period_s > 0.0).then_some(rig.sample_period_s * 1e6),
            delay_us: rig.delay_s * 1e6,
            delay_measured: self
                .link
                .as_ref()
                .is_none_or(|monitor| link::times(monitor).round_trip_s > 0.0),
            damping_ns_per_m: rig.damping,
            friction_n: rig.friction,
            resolution_m: rig.resolution,
        }
    }

    /// The real-time thread, with what has come between it and its processor since.
    pub(crate) fn real_time(&self) -> RealTimeStatus {
        let mut status = self.real_time.clone();
        status
            .problems
            .extend(self.share.as_ref().and_then(ProcessorShare::problem));
        status
    }

    /// The largest force that goes to the rig, N, and whose limit that is.
    pub(crate) fn force_limit(&self) -> (f64, ForceLimitBy) {
        match self.link.as_ref().map(LinkMonitor::state) {
            Some(LinkState::Connected { device, .. }) if device.force_limit_n < self.limits.force_n => {
                (device.force_limit_n, ForceLimitBy::Device)
            }
            _ => (self.limits.force_n, ForceLimitBy::Configuration),
        }
    }

    pub(crate) fn period_s(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let period_ns = self.period_ns as f64;
        period_ns * 1e-9
    }
}

/// Takes a command back when nobody waits for its answer any more, and enters in the journal what has come of it. After the answer there is nothing left to take back.
struct WithdrawOnDrop<'a> {
    rig: &'a RigHandle,
    serial: u32,
    command: Command,
    before: RigState,
    by: Option<&'a Peer>,
}

impl Drop for WithdrawOnDrop<'_> {
    fn drop(&mut self) {
        let shared = &self.rig.shared;
        shared.withdraw();
        let Some(outcome) = shared.answers.command(self.serial).filter(|outcome| !outcome.refused) else {
            return;
        };
        let entry = JournalEntry {
            tick: Some(outcome.tick),
            by: self.by.cloned(),
            state: Some(StateChange {
                before: self.before,
                after: outcome.state,
            }),
            ..JournalEntry::of(self.command.name())
        };
        self.rig.enter(Until::Done, entry);
    }
}

/// The way to the newest scene, where it takes some time.
#[derive(Debug)]
struct Ramp {
    revision: u64,
    way: Way,
}

/// What the rig does by itself, as the newest record shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Seen {
    state: Option<RigState>,
    fault: Option<Fault>,
}

impl Seen {
    fn of(record: &TickRecord) -> Self {
        Self {
            state: Some(record.state),
            fault: record.fault,
        }
    }

    /// What is to be told of it that no client has asked for: the name of the entry, and its words.
    fn news_since(self, before: Self) -> Option<(&'static str, String)> {
        if let Some(fault) = self.fault.filter(|_| self.fault != before.fault) {
            let op = if self.state == Some(RigState::Faulted) {
                "fault"
            } else {
                "stop"
            };
            return Some((op, fault.to_string()));
        }
        // Nothing else leads from force to idle without a ramp.
        let had_force = matches!(before.state, Some(RigState::Engaging | RigState::Engaged));
        (had_force && self.state == Some(RigState::Idle))
            .then(|| ("release", "the rig's enable button was let go".to_owned()))
    }
}

/// Threads that may wait for the library at once, and as many for devices.
const MOST_ASIDE: usize = 4;

/// How long an answer from the real-time thread may take.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Looks for an answer after that: this thread may have been held up itself, and the other not have run since.
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
    seen: Cell<Seen>,
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
            seen: Cell::new(Seen::default()),
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

    /// Completes what the journal has waited for, and tells the subscribers.
    fn keep_journal(&self, changes: &[TickRecord]) {
        let mut journal = self.journal.borrow_mut();
        for record in changes {
            let before = self.seen.replace(Seen::of(record));
            if let Some((op, message)) = Seen::of(record).news_since(before) {
                let entry = JournalEntry {
                    tick: Some(record.tick),
                    revision: record.revision,
                    message: Some(message),
                    ..JournalEntry::of(op)
                };
                journal.enter(Until::Done, entry);
            }
            if record.state == RigState::Disconnected && self.presence.borrow_mut().lost() {
                journal.enter(Until::Done, self.lost(Some(record.tick)));
            }
        }
        if let Some(link) = &self.facts.link {
            for change in self.presence.borrow_mut().look(link) {
                let entry = match change {
                    presence::Change::Lost => self.lost(None),
                    presence::Change::Found { firmware } => JournalEntry {
                        message: Some(format!("{}: {firmware}", self.facts.device)),
                        revision: self.revision(),
                        ..JournalEntry::of("connected")
                    },
                };
                journal.enter(Until::Done, entry);
            }
        }
        let whole = journal.completed(|until, entry| match until {
            Until::Done => true,
            Until::Rendered(revision) => {
                // Where the record itself is at hand it tells the very tick.
                let seen = changes.iter().find(|record| record.revision >= revision);
                let tick = seen
                    .map(|record| record.tick)
                    .or_else(|| self.shared.answers.applied(revision));
                entry.tick = tick;
                tick.is_some()
            }
            Until::Stopped(stop) => match self.shared.answers.stop(stop) {
                Some(Stopped { tick, state, heard, .. }) => {
                    entry.tick = Some(tick);
                    entry.state = entry.state.map(|change| StateChange { after: state, ..change });
                    entry.message = match heard {
                        Heard::Confirmed => None,
                        Heard::Unconfirmed => Some("the device has not confirmed that its motor is off".to_owned()),
                        Heard::NoDevice => Some("no device was connected to take the zero force".to_owned()),
                    };
                    true
                }
                None => false,
            },
        });
        let feed = self.feed.borrow();
        for entry in &whole {
            crate::log::journal(entry);
            feed.tell(entry);
        }
    }

    /// The device can no longer be read, from this tick on where that is known.
    fn lost(&self, tick: Option<u64>) -> JournalEntry {
        JournalEntry {
            tick,
            revision: self.revision(),
            message: Some(self.facts.device.clone()),
            ..JournalEntry::of("disconnected")
        }
    }

    /// The feed, with everything taken in that the loop has left: what was answered is also to be seen.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.pump();
        self.feed.borrow_mut()
    }

    /// The newest scene; it may still be on its way to the real-time thread.
    pub(crate) fn scene(&self) -> Scene {
        self.history.borrow().newest().scene.clone()
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

    /// The newest entries of the journal.
    pub(crate) fn journal(&self, after: u64, limit: usize) -> LogReply {
        self.pump();
        self.journal.borrow().entries(after, limit)
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

    /// The state of the rig while no command is on its way, which is kept so as long as the first of the two is.
    pub(super) async fn quiet_state(&self) -> (tokio::sync::MutexGuard<'_, ()>, RigState) {
        let turn = self.commanding.lock().await;
        (turn, self.state())
    }

    /// Has the loop render something that is no scene, in the place of the newest one, which stays what it is for everybody.
    pub(super) fn lend_loop(&self, renderer: Renderer) {
        // A way to the newest scene ends here: what comes back is its end.
        *self.ramp.borrow_mut() = None;
        let lent = CompiledScene::at_once(renderer, self.revision());
        self.shared.scenes.post(lent);
    }

    /// Has the loop render the newest scene again.
    pub(super) fn give_loop_back(&self) {
        match Renderer::new(&self.scene(), self.facts.scheme, self.facts.period_s()) {
            Ok(renderer) => self.lend_loop(renderer),
            // It was rendered before.
            Err(error) => crate::say(&format!("the scene cannot be rendered any more: {error}")),
        }
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

    /// Says when the rig is to be released by the real-time thread, unless that is moved on.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.shared.lease_until(until_ns);
    }

    /// From now on the daemon ends: force may be let out, and not in.
    pub(crate) fn close(&self) {
        self.closing.set(true);
    }

    pub(crate) fn clients(&self) -> &Cell<usize> {
        &self.clients
    }

    /// Compiles a scene, and the way to it from the one in force where it is to take some time, s.
    ///
    /// # Errors
    /// It cannot be rendered.
    pub(crate) fn compile(&self, scene: &Scene, ramp_s: f64) -> Result<Compiled, WireError> {
        Compiled::new(
            &self.rendered_now(),
            scene,
            self.facts.scheme,
            self.facts.period_s(),
            ramp_s,
        )
    }

    /// The newest scene, as far as the way to it has been gone.
    fn rendered_now(&self) -> Scene {
        let newest = self.scene();
        match &*self.ramp.borrow() {
            Some(Ramp { revision, way }) => {
                let is_begun = self.shared.answers.applied(*revision).is_some();
                way.at(if is_begun { self.shared.answers.steps() } else { 0 }, &newest)
            }
            None => newest,
        }
    }

    /// Whether the newest scene is still being come to in steps.
    pub(crate) fn is_on_its_way(&self) -> bool {
        let answers = &self.shared.answers;
        let goes_on = |ramp: &Ramp| answers.applied(ramp.revision).is_none() || answers.steps() < ramp.way.steps();
        self.ramp.borrow().as_ref().is_some_and(goes_on)
    }

    /// Sends a compiled scene to the real-time thread; returns its revision.
    pub(crate) fn put(&self, scene: Scene, compiled: Compiled, step: Move, entry: JournalEntry) -> u64 {
        let revision = self.history.borrow_mut().moved(step, scene);
        let (scene, way) = compiled.into_scene(revision);
        *self.ramp.borrow_mut() = way.map(|way| Ramp { revision, way });
        self.enter(Until::Rendered(revision), entry);
        self.shared.scenes.post(scene);
        revision
    }

    /// Waits for the tick that first renders a revision, or a newer one.
    ///
    /// # Errors
    /// The real-time thread does not answer: should it go on, it will render the scene.
    pub(crate) async fn rendered(&self, revision: u64) -> Result<u64, WireError> {
        self.answer(|shared| shared.answers.applied(revision)).await
    }

    /// Takes an entry into the journal, at the newest revision.
    pub(crate) fn enter(&self, until: Until, entry: JournalEntry) {
        let revision = self.revision();
        self.journal
            .borrow_mut()
            .enter(until, JournalEntry { revision, ..entry });
    }

    /// What ends the loop with zero force, from whichever thread, also while this one hangs.
    pub(crate) fn end_of_loop(&self) -> impl Fn() + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move || shared.quit()
    }

    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.shared.stops()
    }

    /// Has a command carried out that was asked for, by a client or by the daemon itself, when there had been `stops_known` stops: one that a stop
    /// has overtaken since, in whichever queue it waited, is refused.
    ///
    /// # Errors
    /// The rig's state does not allow it, or the real-time thread does not answer.
    pub(crate) async fn command(
        &self,
        command: Command,
        stops_known: u64,
        by: Option<&Peer>,
    ) -> Result<Outcome, WireError> {
        let admission = match command {
            Command::Engage => admission::admit(self, Purpose::Scene).await?,
            // What lets force out, or only clears, needs no leave.
            Command::Release | Command::Reset => Admission::NONE,
        };
        self.carry_out(command, admission, stops_known, by).await
    }

    /// The same, for somebody who has the permission already.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub(super) async fn carry_out(
        &self,
        command: Command,
        admission: Admission,
        stops_known: u64,
        by: Option<&Peer>,
    ) -> Result<Outcome, WireError> {
        let _turn = self.commanding.lock().await;
        if command == Command::Engage && admission.purpose == Purpose::Scene {
            // Somebody may have begun while it was looked whether this is allowed.
            commission::keep_out(self, "engage")?;
        }
        if self.closing.get() && command == Command::Engage {
            return Err(WireError::new(ErrorCode::WrongState, "cannot engage: the daemon is ending").about("state"));
        }
        let before = self.state();
        let serial = self.serial.get().wrapping_add(1);
        self.serial.set(serial);
        self.shared.admit(admission.connection);
        self.shared.send(serial, command, stops_known);
        // Nobody may find later that a command was carried out which was given up here.
        let withdraw = WithdrawOnDrop {
            rig: self,
            serial,
            command,
            before,
            by,
        };
        let outcome = self.answer(|shared| shared.answers.command(serial)).await?;
        drop(withdraw);
        if !outcome.refused {
            return Ok(outcome);
        }
        let verb = command.name();
        let (code, hint) = match outcome.state {
            RigState::Stopped if command == Command::Reset => (ErrorCode::Stopped, "another stop came in between"),
            RigState::Stopped => (ErrorCode::Stopped, "reset it first"),
            RigState::Faulted => (ErrorCode::Faulted, "reset it first"),
            RigState::Disconnected => (ErrorCode::WrongState, "its device cannot be read"),
            _ if admission.connection != self.connection() => (
                ErrorCode::WrongState,
                "another device was connected in between; try again",
            ),
            _ => (ErrorCode::WrongState, "a stop came in between"),
        };
        Err(WireError::new(
            code,
            format!("cannot {verb} while the rig is {}: {hint}", outcome.state),
        )
        .about("state"))
    }

    /// A sign of life for the real-time thread: whoever calls this hears stops.
    pub(crate) fn beat(&self) {
        self.shared.beat(now_ns());
    }

    /// Samples that were not rendered, because no hand can have made them.
    pub(crate) fn samples_forgotten(&self) -> u64 {
        self.shared.answers.samples_forgotten()
    }

    /// The number of the connection to the device; any, where there is no link.
    fn connection(&self) -> u64 {
        Device::connected(self).map_or(0, |device| device.connection)
    }

    /// Asks for zero force, at once; returns the number by which [`stopped`](Self::stopped) knows the stop.
    pub(crate) fn raise_stop(&self, by: &Peer) -> u64 {
        let stop = self.shared.stop();
        self.feed.borrow_mut().stop_begun(stop, now_ns());
        let before = self
            .feed
            .borrow()
            .newest()
            .map_or(RigState::Idle, |record| record.state);
        // Whoever may only watch may stop, again and again: what changes nothing pushes nothing out of the journal.
        let changes_nothing = matches!(before, RigState::Stopped | RigState::Faulted);
        if !changes_nothing && !self.journal.borrow().waits_for_a_stop() {
            let after = RigState::Stopped;
            let entry = JournalEntry {
                by: Some(by.clone()),
                state: Some(StateChange { before, after }),
                ..JournalEntry::of("stop")
            };
            self.enter(Until::Stopped(stop), entry);
        }
        stop
    }

    /// Waits until a stop has taken the force away; returns the tick that did and the state.
    ///
    /// # Errors
    /// No device is there to take the zero force, or the real-time thread does not answer.
    pub(crate) async fn stopped(&self, stop: u64) -> Result<(u64, RigState), WireError> {
        let Stopped { tick, state, heard, .. } = self.answer(|shared| shared.answers.stop(stop)).await?;
        let (code, what) = match heard {
            Heard::Confirmed => return Ok((tick, state)),
            Heard::NoDevice => (ErrorCode::NoDevice, "no device is connected to take the zero force"),
            Heard::Unconfirmed => (
                ErrorCode::NotConfirmed,
                "the device was sent the zero force and has not confirmed that its motor is off",
            ),
        };
        let message = format!(
            "the rig is {state}, but {what}: if the motor still pulls, cut its power (its own watchdog switches it off, where it has one)"
        );
        Err(WireError::new(code, message).about("device"))
    }

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
            // The real-time thread wakes nobody: that would be a system call.
            pulse.next().await;
        }
    }
}
