//! The loop as the control thread reaches it: what it is sent, what it answers, and whether it may give force.

use crate::control::facts::Facts;
use crate::rt::clock::now_ns;
use crate::rt::handoff::ControlSide;
use crate::rt::inbox::{RigSetup, Sender, SentCommand, ToLoop};
use crate::rt::outbox::{Answers, TickRecord};
use crate::rt::shared::Shared;
use crate::rt::space::CompiledIn;
use crate::telemetry::feed::Feed;
use crate::telemetry::subscribers::KnownScene;
use crate::timers::AnswerTimer;
use haptic_core::OwnMotion;
use haptic_core::limiter::Limits;
use haptic_core::planar::Plane;
use haptic_ipc::{ErrorCode, RigState, ServoSetup, WireError};
use std::cell::{Cell, RefCell, RefMut};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{Mutex, MutexGuard};

/// Timeout of an answer from the real-time thread.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Further looks for an answer after the timeout: this thread itself may have been held up, and the
/// real-time thread may not have run since.
const FINAL_CHECKS: u32 = 20;

/// The control thread's end of the hand-over. Only one thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct LoopChannel {
    shared: Arc<Shared>,
    inbox: RefCell<Sender>,
    feed: RefCell<Feed>,
    /// One command at a time, by its number: the next one waits until it is answered.
    turn: Mutex<()>,
    serial: Cell<u64>,
    /// What is known of the rig, as it went with the newest command to engage.
    sent_setup: Cell<Option<RigSetup>>,
    /// Limits that were sent, until the record of the first tick with them has come.
    sent_limits: Cell<Option<Limits>>,
    /// Clients that engage at this moment.
    engaging: Cell<usize>,
    /// The newest tick in which a command to engage was carried out.
    engaged_at: Cell<u64>,
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
        Self {
            shared,
            inbox: RefCell::new(inbox),
            feed: RefCell::new(Feed::new(records, facts.period_ns, facts.link.clone())),
            turn: Mutex::new(()),
            serial: Cell::new(0),
            sent_setup: Cell::new(None),
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
        if feed.is_snapshot_due() && self.send(ToLoop::Snapshot(Box::new(None))) {
            feed.snapshot_asked();
        }
        changes
    }

    /// The settings that the loop's servo has, or will have with the command to engage that was sent;
    /// `None` while the device is not connected, whose resolution and limit are among them.
    pub(crate) fn servo_in_use(&self, facts: &Facts) -> Option<ServoSetup> {
        let settings = facts.servo.get();
        let begun_with = RigSetup {
            losses: settings.losses,
            compensation: settings.compensation,
        };
        facts
            .is_device_known()
            .then(|| facts.servo_setup(self.sent_setup.get().unwrap_or(begun_with)))
    }

    /// Sends a scene to be rendered; of several that wait the newest is.
    pub(super) fn post(&self, scene: CompiledIn) {
        self.inbox.borrow_mut().post(scene);
    }

    /// Sends a motion of the rig's own likewise.
    pub(super) fn post_motion(&self, motion: OwnMotion, along: Plane) {
        self.inbox.borrow_mut().post_motion(motion, along);
    }

    fn send(&self, entry: ToLoop) -> bool {
        self.send_all(vec![entry])
    }

    /// Sends entries: the loop sees all of them or none. Returns whether there was room.
    pub(super) fn send_all(&self, entries: Vec<ToLoop>) -> bool {
        self.inbox.borrow_mut().send_all(entries)
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
        if !self.send(ToLoop::Command { sent, rig }) {
            return Err(takes_no_commands(sent.command.name()));
        }
        self.sent_setup.set(rig.or(self.sent_setup.get()));
        Ok(())
    }

    /// Sends other limits; returns their number.
    ///
    /// # Errors
    /// The real-time thread takes no commands.
    pub(super) fn send_limits(&self, limits: Limits) -> Result<u64, WireError> {
        let serial = self.next_serial();
        if !self.send(ToLoop::Limits { serial, limits }) {
            return Err(takes_no_commands("change the limits"));
        }
        self.sent_limits.set(Some(limits));
        Ok(serial)
    }

    /// Limits were answered: they hold, also where the record of their first tick was lost.
    pub(super) fn limits_taken(&self, facts: &Facts) {
        if let Some(limits) = self.sent_limits.take() {
            facts.set_limits(limits);
            self.feed.borrow_mut().doubt_servo();
        }
    }

    /// The number of the next command.
    pub(super) fn next_serial(&self) -> u64 {
        self.serial.set(self.serial.get() + 1);
        self.serial.get()
    }

    /// Takes a command back for which nobody waits any more.
    pub(super) fn withdraw(&self, serial: u64) {
        self.shared.withdraw(serial);
    }

    /// A client begins to engage.
    pub(super) fn begin_engaging(&self) -> Engaging<'_> {
        self.engaging.set(self.engaging.get() + 1);
        Engaging(&self.engaging)
    }

    /// A command to engage was carried out in a tick.
    pub(super) fn engaged(&self, tick: u64) {
        self.engaged_at.set(tick);
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
        self.feed.borrow_mut().stop_begun(stop, now_ns());
        stop
    }

    /// Sets the time at which the real-time thread releases the rig, unless it is postponed.
    pub(crate) fn lease_until(&self, until_ns: u64) {
        self.shared.lease_until(until_ns);
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
    pub(in crate::control) fn looks(&self, period_ns: u64) -> Looks {
        Looks {
            timer: AnswerTimer::new(period_ns, self.newest().map(|record| record.deadline_ns)),
            asked: Instant::now(),
            final_checks: FINAL_CHECKS,
        }
    }
}

/// The times to look for an answer, until it is late.
#[derive(Debug)]
pub(in crate::control) struct Looks {
    timer: AnswerTimer,
    asked: Instant,
    final_checks: u32,
}

impl Looks {
    /// Waits for the next time.
    ///
    /// # Errors
    /// The real-time thread has not answered in time.
    pub(in crate::control) async fn next(&mut self) -> Result<(), WireError> {
        let is_late = self.asked.elapsed() > ANSWER_TIMEOUT;
        if is_late && self.final_checks == 0 {
            let message = format!(
                "the real-time thread has not answered for {} ms; cut the power of the motor if it still pulls",
                ANSWER_TIMEOUT.as_millis()
            );
            return Err(WireError::new(ErrorCode::NotResponding, message));
        }
        self.final_checks -= u32::from(is_late);
        // The real-time thread wakes no other: that would be a system call.
        self.timer.next().await;
        Ok(())
    }
}

fn takes_no_commands(what: &str) -> WireError {
    let message =
        format!("cannot {what}: the real-time thread takes no commands; cut the power of the motor if it pulls");
    WireError::new(ErrorCode::NotResponding, message)
}
