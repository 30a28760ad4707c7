//! The loop as the control thread reaches it: what it is sent, what it answers, and whether it may give force.

use crate::control::facts::Facts;
use crate::rt::clock::now_ns;
use crate::rt::handoff::ControlSide;
use crate::rt::inbox::{RigSetup, Sender, SentCommand, ToLoop};
use crate::rt::outbox::{Answers, TickRecord};
use crate::rt::shared::Shared;
use crate::telemetry::feed::Feed;
use crate::telemetry::subscribers::KnownScene;
use crate::timers::AnswerTimer;
use haptic_core::limiter::Limits;
use haptic_core::servo::Settings;
use haptic_ipc::{ErrorCode, RigState, ServoSetup, WireError};
use std::cell::{Cell, RefCell, RefMut};
use std::collections::VecDeque;
use std::sync::Arc;
use tokio::sync::{Mutex, MutexGuard};

/// The control thread's end of the hand-over. Only one thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct LoopChannel {
    pub(in crate::control) shared: Arc<Shared>,
    pub(super) inbox: RefCell<Sender>,
    feed: RefCell<Feed>,
    /// One command at a time, by its number: the next one waits until it is answered.
    turn: Mutex<()>,
    serial: Cell<u64>,
    /// What is known of the rig, as it went with the newest command to engage; before one as the loop began.
    sent_setup: Cell<RigSetup>,
    /// Limits that were sent, until the record of the first tick with them has come.
    sent_limits: Cell<Option<Limits>>,
    /// Clients that engage at this moment.
    engaging: Cell<usize>,
    /// The newest tick in which a command to engage was carried out.
    pub(super) engaged_at: Cell<u64>,
    /// The daemon ends: the rig can be released, but no longer engaged.
    is_closing: Cell<bool>,
    /// Whether clients find the socket.
    is_reachable: Cell<bool>,
}

/// As long as it lives a client engages: until the answer every change of the scene is judged as one under force.
pub(super) struct Engaging<'a>(&'a Cell<usize>);

impl Drop for Engaging<'_> {
    fn drop(&mut self) {
        self.0.set(self.0.get() - 1);
    }
}

impl LoopChannel {
    pub(super) fn new(control: ControlSide, facts: &Facts) -> Self {
        let ControlSide { shared, inbox, records } = control;
        let Settings {
            losses, compensation, ..
        } = facts.servo.get();
        Self {
            shared,
            inbox: RefCell::new(inbox),
            feed: RefCell::new(Feed::new(records, facts.period_ns, facts.link.clone())),
            turn: Mutex::new(()),
            serial: Cell::new(0),
            sent_setup: Cell::new(RigSetup { losses, compensation }),
            sent_limits: Cell::new(None),
            engaging: Cell::new(0),
            engaged_at: Cell::new(0),
            is_closing: Cell::new(false),
            is_reachable: Cell::new(true),
        }
    }

    /// What the records have brought so far.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.feed.borrow_mut()
    }

    /// The newest record; `None` before the first.
    pub(crate) fn newest(&self) -> Option<TickRecord> {
        self.feed.borrow().newest().copied()
    }

    /// The rig's state in the newest record.
    pub(crate) fn state(&self) -> RigState {
        self.feed.borrow().state()
    }

    /// Exchanges with the real-time thread what waits on both sides; returns what it has answered so far.
    pub(super) fn exchange(&self) -> Answers {
        self.inbox.borrow_mut().flush();
        let mut feed = self.feed.borrow_mut();
        feed.take_records();
        feed.answers()
    }

    /// Distributes the records that were taken to the subscribers; returns the first one of each state and revision.
    pub(super) fn distribute(&self, facts: &Facts, scenes: &VecDeque<KnownScene>) -> Vec<TickRecord> {
        let mut feed = self.feed.borrow_mut();
        let servo_of = |record: &TickRecord| {
            if record.input_word.has_new_limits()
                && let Some(limits) = self.sent_limits.take()
            {
                facts.set_limits(limits);
            }
            self.servo_in_use(facts)
        };
        let changes = feed.update_subscribers(scenes, servo_of);
        if feed.is_snapshot_due() && self.inbox.borrow_mut().send(ToLoop::Snapshot(Box::new(None))) {
            feed.snapshot_asked();
        }
        changes
    }

    /// The settings that the loop's servo has, or will have with the command to engage that was sent;
    /// `None` while the device is not connected, whose resolution and limit are among them.
    pub(crate) fn servo_in_use(&self, facts: &Facts) -> Option<ServoSetup> {
        facts
            .is_device_known()
            .then(|| facts.servo_setup(self.sent_setup.get()))
    }

    /// The turn to send a command.
    pub(super) async fn turn(&self) -> MutexGuard<'_, ()> {
        self.turn.lock().await
    }

    /// Sends a command, which may engage the device of one connection; returns its number. `rig` goes with a command to
    /// engage.
    ///
    /// # Errors
    /// The real-time thread takes no commands.
    pub(super) fn send_command(&self, sent: SentCommand, rig: Option<RigSetup>) -> Result<(), WireError> {
        if !self.inbox.borrow_mut().send(ToLoop::Command { sent, rig }) {
            return Err(takes_no_commands(sent.command.name()));
        }
        self.sent_setup.set(rig.unwrap_or(self.sent_setup.get()));
        Ok(())
    }

    /// Sends other limits; returns their number.
    ///
    /// # Errors
    /// The real-time thread takes no commands.
    pub(super) fn send_limits(&self, limits: Limits) -> Result<u64, WireError> {
        let serial = self.next_serial();
        if !self.inbox.borrow_mut().send(ToLoop::Limits { serial, limits }) {
            return Err(takes_no_commands("change the limits"));
        }
        self.sent_limits.set(Some(limits));
        Ok(serial)
    }

    /// Limits were answered: they hold, also where the record of their first tick was lost.
    pub(super) fn limits_taken(&self, facts: &Facts) {
        if let Some(limits) = self.sent_limits.take() {
            facts.set_limits(limits);
            self.feed.borrow_mut().servo_is_doubtful = true;
        }
    }

    /// The number of the next command.
    pub(super) fn next_serial(&self) -> u64 {
        self.serial.set(self.serial.get() + 1);
        self.serial.get()
    }

    /// A client begins to engage.
    pub(super) fn begin_engaging(&self) -> Engaging<'_> {
        self.engaging.set(self.engaging.get() + 1);
        Engaging(&self.engaging)
    }

    /// Begins the end of the daemon.
    pub(crate) fn close(&self) {
        self.is_closing.set(true);
    }

    /// Refuses to engage while the daemon ends.
    ///
    /// # Errors
    /// It does.
    pub(super) fn refuse_at_end(&self) -> Result<(), WireError> {
        if self.is_closing.get() {
            let message = "cannot engage: the daemon is ending";
            return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
        }
        Ok(())
    }

    /// Whether force flows, or may in the next ticks.
    pub(crate) fn may_have_force(&self) -> bool {
        // The record of the tick that engaged may be lost.
        let tick = self.newest().map_or(0, |record| record.tick);
        self.state().is_live() || self.engaging.get() > 0 || tick < self.engaged_at.get()
    }

    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.shared.stops()
    }

    /// Asks for zero force at once; returns the number of the stop.
    pub(super) fn stop(&self) -> u64 {
        let stop = self.shared.stop();
        self.feed.borrow_mut().timing.stops.begin(stop, now_ns());
        stop
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

    /// The times to look for an answer of a loop of this period, ns.
    pub(in crate::control) fn looks(&self, period_ns: u64) -> AnswerTimer {
        AnswerTimer::new(period_ns, self.newest().map(|record| record.deadline_ns))
    }
}

fn takes_no_commands(what: &str) -> WireError {
    let message =
        format!("cannot {what}: the real-time thread takes no commands; cut the power of the motor if it pulls");
    WireError::new(ErrorCode::NotResponding, message)
}
