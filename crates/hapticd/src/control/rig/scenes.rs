//! Scenes on their way to the real-time thread.

use super::{Ramp, RigHandle};
use crate::control::compile::Compiled;
use crate::control::history::Move;
use crate::control::journal::Completion;
use haptic_core::servo::CompiledScene;
use haptic_core::{OwnMotion, Renderer, Scene};
use haptic_ipc::{JournalEntry, WireError};
use std::rc::Rc;

impl RigHandle {
    /// Makes the loop render a motion of the rig's own instead of the newest scene, which for clients stays the same.
    pub(in crate::control) fn lend_loop(&self, motion: OwnMotion) {
        // A ramp to the newest scene ends here: the loop will get its end back.
        *self.ramp.borrow_mut() = None;
        self.inbox.borrow_mut().post_motion(motion);
    }

    /// Makes the loop render the newest scene again.
    pub(in crate::control) fn give_loop_back(&self) {
        match Renderer::new(&self.scene(), self.facts.scheme, self.facts.period_s()) {
            Ok(renderer) => {
                let scene = CompiledScene::at_once(renderer, self.revision());
                self.inbox.borrow_mut().post(scene);
            }
            // It was rendered before.
            Err(error) => crate::say(&format!("the scene cannot be rendered any more: {error}")),
        }
    }

    /// Compiles a scene, and the ramp to it from the active one if `ramp_s` is not 0.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(crate) fn compile(&self, scene: &Scene, ramp_s: f64) -> Result<Compiled, WireError> {
        let steps = self.ramp_steps();
        let (newest, ramp) = (self.scene(), self.ramp.borrow());
        let on_the_way = ramp
            .as_ref()
            .zip(steps)
            .map(|(ramp, steps)| ramp.path.at(steps, &newest));
        let from = on_the_way.as_ref().unwrap_or(&newest);
        self.compile_from(from, scene, ramp_s)
    }

    /// Compiles a scene, and the ramp to it from another if `ramp_s` is not 0.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(in crate::control) fn compile_from(
        &self,
        from: &Scene,
        to: &Scene,
        ramp_s: f64,
    ) -> Result<Compiled, WireError> {
        Compiled::new(from, to, self.facts.scheme, self.facts.period_s(), ramp_s)
    }

    /// The steps of the ramp to the newest scene that are rendered; `None` without a ramp.
    fn ramp_steps(&self) -> Option<usize> {
        let newest = self.feed().newest().map(|record| (record.revision, record.ramp_steps));
        let ramp = self.ramp.borrow();
        let revision = ramp.as_ref()?.revision;
        Some(newest.map_or(
            0,
            |(rendered, steps)| if rendered < revision { 0 } else { steps.into() },
        ))
    }

    /// Whether a ramp to the newest scene is under way.
    pub(crate) fn is_ramping(&self) -> bool {
        let steps = self.ramp_steps();
        let ramp = self.ramp.borrow();
        ramp.as_ref()
            .zip(steps)
            .is_some_and(|(ramp, steps)| steps < ramp.path.steps())
    }

    /// Sends a compiled scene to the real-time thread; returns its revision.
    pub(crate) fn apply(&self, scene: Rc<Scene>, compiled: Compiled, step: Move, entry: JournalEntry) -> u64 {
        let revision = {
            let mut history = self.history.borrow_mut();
            let revision = history.moved(step, scene);
            history.keep_ramp(compiled.ramp().cloned());
            revision
        };
        let (scene, path) = compiled.into_scene(revision);
        *self.ramp.borrow_mut() = path.map(|path| Ramp { revision, path });
        self.enter(Completion::Rendered(revision), entry);
        self.inbox.borrow_mut().post(scene);
        revision
    }

    /// Waits for the tick that first renders a revision, or a newer one.
    ///
    /// # Errors
    /// The real-time thread does not answer; if it continues, it will render the scene.
    pub(crate) async fn rendered(&self, revision: u64) -> Result<u64, WireError> {
        self.answer(|answers| answers.applied(revision)).await
    }
}
