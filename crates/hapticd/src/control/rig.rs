//! The rig as the control thread sees it: the newest scene, the way to the real-time thread, and what comes back.

use crate::rig_state::Command;
use crate::rt::handoff::{CompiledScene, Outcome, Shared};
use crate::telemetry::feed::Feed;
use haptic_core::adviser::RigFacts;
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::{ErrorCode, RealTimeStatus, RigState, WireError};
use std::cell::{Cell, RefCell, RefMut};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What does not change while the daemon runs.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    pub(crate) server: String,
    pub(crate) device: String,
    pub(crate) force_limit_n: f64,
    pub(crate) rig: RigFacts,
    pub(crate) period_ns: u64,
    pub(crate) scheme: Scheme,
    pub(crate) velocity: Method,
    pub(crate) real_time: RealTimeStatus,
}

impl Facts {
    pub(crate) fn period_s(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let period_ns = self.period_ns as f64;
        period_ns * 1e-9
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
    scene: RefCell<Scene>,
    revision: Cell<u64>,
    clients: Cell<usize>,
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
            scene: RefCell::new(scene),
            revision: Cell::new(revision),
            clients: Cell::new(0),
            serial: Cell::new(0),
            commanding: tokio::sync::Mutex::new(()),
        }
    }

    /// Moves telemetry on, and frees what the real-time thread gave back.
    pub(crate) fn pump(&self) {
        self.shared.drop_retired();
        self.feed.borrow_mut().pump(&self.scene.borrow(), self.revision.get());
    }

    /// The feed, with everything taken in that the loop has left: what was answered is also to be seen.
    pub(crate) fn feed(&self) -> RefMut<'_, Feed> {
        self.pump();
        self.feed.borrow_mut()
    }

    pub(crate) fn scene(&self) -> Scene {
        self.scene.borrow().clone()
    }

    pub(crate) fn revision(&self) -> u64 {
        self.revision.get()
    }

    pub(crate) fn clients(&self) -> &Cell<usize> {
        &self.clients
    }

    /// Puts a scene in force; returns its revision and the tick that first rendered it.
    ///
    /// # Errors
    /// It cannot be rendered, and nothing has changed; or the real-time thread does not answer.
    pub(crate) async fn apply(&self, scene: Scene) -> Result<(u64, u64), WireError> {
        let renderer = Renderer::new(&scene, self.facts.scheme, self.facts.period_s())?;
        let revision = self.revision.get() + 1;
        self.revision.set(revision);
        self.scene.replace(scene);
        self.shared.scenes.post(CompiledScene { renderer, revision });
        let tick = self.answer(|shared| shared.answers.applied(revision)).await?;
        Ok((revision, tick))
    }

    /// Has a command carried out.
    ///
    /// # Errors
    /// The rig's state does not allow it, or the real-time thread does not answer.
    pub(crate) async fn command(&self, command: Command) -> Result<Outcome, WireError> {
        let _turn = self.commanding.lock().await;
        let serial = self.serial.get().wrapping_add(1);
        self.serial.set(serial);
        self.shared.send(serial, command);
        let outcome = self.answer(|shared| shared.answers.command(serial)).await?;
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

    /// Takes the force away; returns the tick that did and the state.
    ///
    /// # Errors
    /// The real-time thread does not answer.
    pub(crate) async fn stop(&self) -> Result<(u64, RigState), WireError> {
        let stop = self.shared.stop();
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
