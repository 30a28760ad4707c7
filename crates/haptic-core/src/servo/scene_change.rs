//! A new scene: the step of force that it makes is let in slowly, and what it replaces fades out.

use super::servo::Servo;
use super::transition::{CompiledScene, FadingScene, Transition};
use alloc::boxed::Box;

impl Servo {
    /// Replaces the scene that is rendered.
    pub(super) fn change_scene(&mut self, mut new: Box<CompiledScene>) {
        let step = new.renderer.take_over(&self.scene.renderer);
        let fade_s = match new.transition {
            Transition::Fade { over_s } => over_s,
            Transition::AtOnce | Transition::Steps(_) => 0.0,
        };
        let old = core::mem::replace(&mut self.scene, new);
        if let Some(before) = self.fading.take() {
            // The force of a scene that was still fading fades on as every step of force does.
            self.offset.add(before.excess());
            self.retire(before.into_scene());
        }
        if fade_s > 0.0 && self.rig.is_live() {
            self.fading = Some(FadingScene::new(old, fade_s));
        } else {
            self.offset.add(step);
            self.retire(old);
        }
    }

    /// Whether the scene takes effect step by step, or another one fades out.
    #[inline(always)]
    pub(super) fn is_changing(&self) -> bool {
        matches!(self.scene.transition, Transition::Steps(_)) || self.fading.is_some()
    }

    /// Carries on with a change of scene that takes its time; ends it at once while no force flows.
    #[inline(never)]
    pub(super) fn carry_on_change(&mut self, elapsed_s: f64) {
        let CompiledScene {
            renderer, transition, ..
        } = &mut *self.scene;
        if let Transition::Steps(steps) = transition {
            if self.was_live {
                if let Some(step) = steps.advance(elapsed_s, renderer) {
                    self.offset.add(step);
                }
            } else {
                steps.finish(renderer);
            }
        }
        let elapsed_s = if self.was_live { elapsed_s } else { f64::INFINITY };
        if let Some(faded) = self.fading.take_if(|fading| fading.is_over_after(elapsed_s)) {
            self.retire(faded.into_scene());
        }
    }
}
