//! The rig as the control thread sees it: the newest scene, the way to the real-time thread, and what comes back.

use crate::rig_state::Command;
use crate::rt::handoff::{CompiledScene, Outcome, Shared};
use crate::telemetry::feed::Feed;
use device_io::Address;
use device_io::link::{LinkMonitor, LinkState, RunningKeeper};
use haptic_core::adviser::RigFacts;
use haptic_core::limiter::Limits;
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::{ErrorCode, RealTimeStatus, RigState, WireError};
use std::cell::{Cell, RefCell, RefMut};
use std::collections::VecDeque;
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
    pub(crate) rig: RigFacts,
    /// The link to the rig, where it is not in this process.
    pub(crate) link: Option<LinkMonitor>,
    /// Looks after that link as long as it is here.
    pub(crate) keeper: Option<RunningKeeper>,
    pub(crate) period_ns: u64,
    pub(crate) scheme: Scheme,
    pub(crate) velocity: Method,
    pub(crate) real_time: RealTimeStatus,
}

impl Facts {
    /// What the adviser goes by: with a link, the resolution is that of the device that is connected.
    pub(crate) fn rig_facts(&self) -> RigFacts {
        match self.link.as_ref().map(LinkMonitor::state) {
            Some(LinkState::Connected { resolution_m, .. }) => RigFacts {
                resolution: resolution_m,
                ..self.rig
            },
            _ => self.rig,
        }
    }

    pub(crate) fn period_s(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let period_ns = self.period_ns as f64;
        period_ns * 1e-9
    }
}

/// Takes a command back when nobody waits for its answer any more. After the answer there is nothing left to take back.
struct WithdrawOnDrop<'a>(&'a Shared);

impl Drop for WithdrawOnDrop<'_> {
    fn drop(&mut self) {
        self.0.withdraw();
    }
}

/// How long an answer from the real-time thread may take.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// The control thread's hold on the rig. One thread uses it, so cells suffice.
#[derive(Debug)]
pub(crate) struct RigHandle {
    pub(crate) facts: Facts,
    shared: Arc<Shared>,
    feed: RefCell<Feed>,
    /// The scenes from the one in force to the newest, each with its revision; never empty.
    scenes: RefCell<VecDeque<(u64, Scene)>>,
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
            scenes: RefCell::new(VecDeque::from([(revision, scene)])),
            clients: Cell::new(0),
            closing: Cell::new(false),
            serial: Cell::new(0),
            commanding: tokio::sync::Mutex::new(()),
        }
    }

    /// Moves telemetry on, and frees what the real-time thread gave back.
    pub(crate) fn pump(&self) {
        self.shared.drop_retired();
        let mut scenes = self.scenes.borrow_mut();
        let in_force = self.feed.borrow_mut().pump(&scenes);
        // At least one is kept: the one in force.
        while scenes.len() > 1 && scenes.front().is_some_and(|(revision, _)| *revision < in_force) {
            scenes.pop_front();
        }
    }

    /// The feed, with everything taken in that the loop has left: what was answered is also to be seen.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.pump();
        self.feed.borrow_mut()
    }

    /// The newest scene; it may still be on its way to the real-time thread.
    pub(crate) fn scene(&self) -> Scene {
        let scenes = self.scenes.borrow();
        let (_, newest) = scenes.back().expect("there is always a scene");
        newest.clone()
    }

    /// Revision of the newest scene.
    pub(crate) fn revision(&self) -> u64 {
        self.scenes.borrow().back().map_or(0, |(revision, _)| *revision)
    }

    /// From now on the daemon ends: force may be let out, and not in.
    pub(crate) fn close(&self) {
        self.closing.set(true);
    }

    pub(crate) fn clients(&self) -> &Cell<usize> {
        &self.clients
    }

    /// Puts a scene in force; returns its revision and the tick that first rendered it.
    ///
    /// # Errors
    /// It cannot be rendered, and nothing has changed; or the real-time thread does not answer: should it go on, it will render the scene.
    pub(crate) async fn apply(&self, scene: Scene) -> Result<(u64, u64), WireError> {
        let renderer = Renderer::new(&scene, self.facts.scheme, self.facts.period_s())?;
        let revision = self.revision() + 1;
        self.scenes.borrow_mut().push_back((revision, scene));
        self.shared.scenes.post(CompiledScene { renderer, revision });
        let tick = self.answer(|shared| shared.answers.applied(revision)).await?;
        Ok((revision, tick))
    }

    /// Stops asked for so far.
    pub(crate) fn stops(&self) -> u64 {
        self.shared.stops()
    }

    /// Has a command carried out that was asked for when there had been `stops_known` stops: one that a stop has overtaken since, in whichever
    /// queue it waited, is refused.
    ///
    /// # Errors
    /// The rig's state does not allow it, or the real-time thread does not answer.
    pub(crate) async fn command(&self, command: Command, stops_known: u64) -> Result<Outcome, WireError> {
        let _turn = self.commanding.lock().await;
        if self.closing.get() && command == Command::Engage {
            return Err(WireError::new(ErrorCode::WrongState, "cannot engage: the daemon is ending").about("state"));
        }
        let serial = self.serial.get().wrapping_add(1);
        self.serial.set(serial);
        self.shared.send(serial, command, stops_known);
        // Nobody may find later that a command was carried out which was given up here.
        let withdraw = WithdrawOnDrop(&self.shared);
        let outcome = self.answer(|shared| shared.answers.command(serial)).await?;
        drop(withdraw);
        if !outcome.refused {
            return Ok(outcome);
        }
        let verb = match command {
            Command::Engage => "engage",
            Command::Release => "release",
            Command::Reset => "reset",
        };
        let (code, hint) = match outcome.state {
            RigState::Stopped if command == Command::Reset => (ErrorCode::Stopped, "another stop came in between"),
            RigState::Stopped => (ErrorCode::Stopped, "reset it first"),
            RigState::Faulted => (ErrorCode::Faulted, "reset it first"),
            RigState::Disconnected => (ErrorCode::WrongState, "its device cannot be read"),
            _ => (ErrorCode::WrongState, "a stop came in between"),
        };
        Err(WireError::new(
            code,
            format!("cannot {verb} while the rig is {}: {hint}", outcome.state),
        )
        .about("state"))
    }

    /// Asks for zero force, at once; returns the number by which [`stopped`](Self::stopped) knows the stop.
    pub(crate) fn raise_stop(&self) -> u64 {
        self.shared.stop()
    }

    /// Waits until a stop has taken the force away; returns the tick that did and the state.
    ///
    /// # Errors
    /// The real-time thread does not answer.
    pub(crate) async fn stopped(&self, stop: u64) -> Result<(u64, RigState), WireError> {
        self.answer(|shared| shared.answers.stop(stop)).await
    }

    async fn answer<T>(&self, answered: impl Fn(&Shared) -> Option<T>) -> Result<T, WireError> {
        let asked = Instant::now();
        loop {
            if let Some(answer) = answered(&self.shared) {
                return Ok(answer);
            }
            if asked.elapsed() > ANSWER_TIMEOUT {
                return Err(WireError::new(
                    ErrorCode::NotResponding,
                    format!(
                        "the real-time thread has not answered for {} ms; cut the power of the motor if it still pulls",
                        ANSWER_TIMEOUT.as_millis()
                    ),
                ));
            }
            // The real-time thread wakes nobody: that would be a system call.
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}
