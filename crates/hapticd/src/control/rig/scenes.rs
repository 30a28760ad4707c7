//! Scenes on their way to the real-time thread: compiled, sent and rendered.

use super::RigHandle;
use crate::control::facts::Facts;
use crate::control::history::Move;
use crate::control::journal::Completion;
use crate::rt::space::CompiledIn;
use haptic_core::planar::Plane;
use haptic_core::{OwnMotion, Scene};
use haptic_ipc::{JournalEntry, SceneRamp, WireError};
use std::rc::Rc;

/// A scene, ready to be handed over, and the ramp to it.
#[derive(Debug)]
pub(in crate::control) struct Compiled {
    scene: CompiledIn,
    ramp: Option<SceneRamp>,
    /// Length of the ramp in ticks, if there is one.
    pub(in crate::control) ramp_ticks: Option<u64>,
}

impl Compiled {
    /// Compiles a scene and, if `ramp_s` (seconds) is not 0, the ramp to it from another.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(in crate::control) fn new(from: &Scene, to: &Scene, facts: &Facts, ramp_s: f64) -> Result<Self, WireError> {
        let period_s = facts.period_s();
        let scene = CompiledIn::ramped(facts.is_plane(), from, to, facts.scheme, period_s, ramp_s)?;
        let takes_time = ramp_s > 0.0;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most ten seconds of ticks"
        )]
        let ramp_ticks = takes_time.then(|| (ramp_s / period_s).ceil() as u64);
        Ok(Self {
            scene,
            ramp: takes_time.then(|| SceneRamp {
                from: from.clone(),
                over_s: ramp_s,
            }),
            ramp_ticks,
        })
    }

    /// How many scenes lead to it, with itself; 0 where it takes effect at once or fades in.
    pub(super) fn steps(&self) -> usize {
        self.scene.steps()
    }

    /// The scene for the real-time thread, and the ramp to it if it has one.
    pub(super) fn into_parts(self, revision: u64) -> (CompiledIn, Option<SceneRamp>) {
        (self.scene.numbered(revision), self.ramp)
    }
}

impl RigHandle {
    /// Makes the loop render a motion of the rig's own, along a direction on a rig of two axes. For clients the newest
    /// scene stays the same.
    pub(in crate::control) fn lend_loop(&self, motion: OwnMotion, along: Plane) {
        // A ramp to the newest scene ends here: the loop will get its end back.
        self.history_mut().end_ramp();
        self.channel.inbox.borrow_mut().post_motion(motion, along);
    }

    /// Makes the loop render the newest scene again.
    pub(in crate::control) fn give_loop_back(&self) {
        let scene = self.scene();
        match Compiled::new(&scene, &scene, &self.facts, 0.0) {
            Ok(compiled) => self
                .channel
                .inbox
                .borrow_mut()
                .post(compiled.into_parts(self.revision()).0),
            // It was rendered before.
            Err(error) => crate::say(&format!("the scene cannot be rendered any more: {}", error.message)),
        }
    }

    /// Compiles a scene, and the ramp to it from the active one if `ramp_s` is not 0.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(in crate::control) fn compile(&self, scene: &Scene, ramp_s: f64) -> Result<Compiled, WireError> {
        let history = self.history();
        let ramped = history.ramped_scene(self.channel.newest().as_ref());
        let from = ramped.as_ref().unwrap_or(&history.newest().scene);
        Compiled::new(from, scene, &self.facts, ramp_s)
    }

    /// Whether a ramp to the newest scene is under way.
    pub(in crate::control) fn is_ramping(&self) -> bool {
        self.history().is_ramping(self.channel.newest().as_ref())
    }

    /// Sends a compiled scene to the real-time thread; returns its revision.
    pub(in crate::control) fn apply(
        &self,
        scene: Rc<Scene>,
        compiled: Compiled,
        step: Move,
        entry: JournalEntry,
    ) -> u64 {
        let revision = self.history_mut().moved(step, scene);
        let steps = compiled.steps();
        let (scene, ramp) = compiled.into_parts(revision);
        self.history_mut().keep_ramp(ramp, steps);
        self.enter(Completion::Rendered(revision), entry);
        self.channel.inbox.borrow_mut().post(scene);
        revision
    }

    /// Waits for the tick that first renders a revision, or a newer one.
    ///
    /// # Errors
    /// The real-time thread does not answer; if it continues, it will render the scene.
    pub(in crate::control) async fn rendered(&self, revision: u64) -> Result<u64, WireError> {
        self.answer(|answers| answers.applied(revision)).await
    }
}
