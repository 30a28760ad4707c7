//! How a scene takes effect: at once, in small steps, or by fading over from the one before.
//!
//! Steps are whole scenes between the two, compiled elsewhere: each is put in place as a new scene
//! is, and nothing is computed, allocated or freed for it. Between scenes of different laws there
//! are no scenes; both are rendered for a while, and the force goes over from one to the other.
//!
//! The step of force that a new scene makes is taken back at once and let in slowly; what the scene
//! replaces fades out.

use crate::OwnMotion;
use crate::renderer::Rendering;
use crate::servo::servo::Servo;
use crate::snapshot::Archive;
use crate::vector::Vector;
use alloc::boxed::Box;
use alloc::vec::Vec;

/// A scene, ready to be rendered.
#[derive(Debug)]
pub struct CompiledScene<V: Vector = f64> {
    /// What is rendered; while the scene takes effect step by step, the step that it has reached.
    pub renderer: V::Renderer,
    /// Number of the scene.
    pub revision: u64,
    /// How it takes effect.
    pub transition: Transition<V>,
}

impl<V: Vector> CompiledScene<V> {
    /// Saves or loads how far it has taken effect, and its motion.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        if let Transition::Steps(steps) = &mut self.transition {
            let mut taken = steps.taken;
            archive.place("steps", &mut taken, steps.count());
            if archive.is_loading() {
                steps.take(taken, &mut self.renderer);
            }
            archive.number("steps_s", &mut steps.gone_s);
        }
        self.renderer.archive(archive);
    }

    /// A scene that takes effect at once.
    #[must_use]
    pub fn at_once(renderer: V::Renderer, revision: u64) -> Self {
        Self {
            renderer,
            revision,
            transition: Transition::AtOnce,
        }
    }
}

/// How a scene takes effect.
#[derive(Debug, Default)]
pub enum Transition<V: Vector = f64> {
    /// In the step that takes it.
    #[default]
    AtOnce,
    /// Through scenes in between, the last of them the scene itself.
    Steps(Steps<V>),
    /// By fading over from the force of the one before.
    Fade {
        /// Time that it takes, s.
        over_s: f64,
    },
}

/// Scenes on the path from one to another, at equal distances in time.
#[derive(Debug)]
pub struct Steps<V: Vector = f64> {
    /// Those yet to come; in the places of those that came, the ones that they replaced.
    renderers: Vec<V::Renderer>,
    taken: usize,
    over_s: f64,
    gone_s: f64,
}

impl<V: Vector> Steps<V> {
    /// The scenes after the first one, of which the last is the scene itself, over a time, s.
    #[must_use]
    pub fn new(renderers: Vec<V::Renderer>, over_s: f64) -> Self {
        Self {
            renderers,
            taken: 0,
            over_s,
            gone_s: 0.0,
        }
    }

    /// Steps in all.
    #[must_use]
    pub fn count(&self) -> usize {
        self.renderers.len()
    }

    /// Steps taken so far.
    #[must_use]
    pub fn taken(&self) -> usize {
        self.taken
    }

    /// Advances by a time; puts the scene that is then due in the place of `current`. Returns the
    /// step of force that must be let in slowly, N, if there was a new scene.
    pub(super) fn advance(&mut self, elapsed_s: f64, current: &mut V::Renderer) -> Option<V> {
        if self.taken == self.renderers.len() {
            return None;
        }
        self.gone_s += elapsed_s;
        #[expect(clippy::cast_precision_loss, reason = "a few hundred steps")]
        let count = self.renderers.len() as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to the number of steps"
        )]
        let due = (self.gone_s / self.over_s * count).clamp(0.0, count) as usize;
        self.take(due, current)
    }

    /// Puts the last scene in place, whatever the time.
    pub(super) fn finish(&mut self, current: &mut V::Renderer) {
        // Without force on the hand there is no step of it to let in.
        if self.take(self.renderers.len(), current).is_some() {
            self.gone_s = self.over_s;
        }
    }

    fn take(&mut self, due: usize, current: &mut V::Renderer) -> Option<V> {
        if due <= self.taken {
            return None;
        }
        self.taken = due;
        let next = &mut self.renderers[due - 1];
        let step = next.take_over(current);
        core::mem::swap(next, current);
        Some(step)
    }
}

/// A scene whose force fades out.
#[derive(Debug)]
pub(super) struct FadingScene<V: Vector> {
    scene: Box<CompiledScene<V>>,
    left_s: f64,
    over_s: f64,
    /// What it last added to the force of the incoming scene, N.
    excess: V,
}

impl<V: Vector> FadingScene<V> {
    /// Saves or loads how far it has faded.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("left_s", &mut self.left_s);
        archive.number("over_s", &mut self.over_s);
        archive.vector("excess_N", &mut self.excess);
        self.scene.archive(archive);
    }

    pub(super) fn revision(&self) -> u64 {
        self.scene.revision
    }

    pub(super) fn new(scene: Box<CompiledScene<V>>, over_s: f64) -> Self {
        Self {
            scene,
            left_s: over_s,
            over_s,
            excess: V::ZERO,
        }
    }

    /// What it last added to the force of the incoming scene, N.
    pub(super) fn excess(&self) -> V {
        self.excess
    }

    pub(super) fn into_scene(self) -> Box<CompiledScene<V>> {
        self.scene
    }

    /// Lets a time go by, s; returns whether the fade is over.
    pub(super) fn is_over_after(&mut self, elapsed_s: f64) -> bool {
        self.left_s -= elapsed_s;
        self.left_s <= 0.0
    }

    /// What is left of its force, beyond that of the incoming scene, N.
    pub(super) fn tick(&mut self, elapsed_s: f64, position: V, velocity: V, incoming_force: V) -> V {
        let force = self.scene.renderer.render(elapsed_s, position, velocity);
        self.excess = (force - incoming_force) * (self.left_s / self.over_s);
        self.excess
    }
}

impl<V: Vector> Servo<V> {
    /// Moves the handle by the rig's own motor instead of rendering the scene, from the next step on until a scene
    /// arrives. Whatever force there was ends at once.
    ///
    /// It goes along a line through the handle, whose direction is a vector of the length 1: on a line 1.0.
    pub fn begin_own_motion(&mut self, mut motion: OwnMotion, along: V) {
        motion.place(self.sensing.position_m.dot(along), self.sensing.velocity_mps.dot(along));
        self.own_motion = Some(motion);
        (self.motion_along, self.motion_from) = (along, self.sensing.position_m);
        self.offset = ForceOffset::default();
        if let Transition::Steps(steps) = &mut self.scene.transition {
            steps.finish(&mut self.scene.renderer);
        }
        if let Some(fading) = self.fading.take() {
            self.retire(fading.into_scene());
        }
    }

    /// Replaces the scene that is rendered, or the motion of the rig's own.
    pub(super) fn change_scene(&mut self, mut new: Box<CompiledScene<V>>) {
        if self.own_motion.take().is_some() {
            // The scene from which the new one takes over was not rendered meanwhile.
            let (position, velocity) = (self.sensing.position_m, self.sensing.velocity_mps);
            self.scene.renderer.start_at(position, velocity);
        }
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

/// Time in which the step takes effect, s.
const FADE_S: f64 = 0.05;

/// A step of force that a new scene would have caused, taken back and then let in over 50 ms.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForceOffset<V> {
    /// What was taken back when the fade began, N.
    force: V,
    left_s: f64,
}

impl<V: Vector> ForceOffset<V> {
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.vector("step_N", &mut self.force);
        archive.number("left_s", &mut self.left_s);
    }

    /// Takes back a step, N; what is left of the last one is taken back with it.
    pub(super) fn add(&mut self, step: V) {
        if step != V::ZERO {
            self.force = self.now() + step;
            self.left_s = FADE_S;
        }
    }

    fn now(&self) -> V {
        self.force * (self.left_s / FADE_S)
    }

    /// What is taken back after a time, N.
    pub(super) fn fade(&mut self, elapsed_s: f64) -> V {
        if self.left_s <= 0.0 {
            return V::ZERO;
        }
        self.left_s = (self.left_s - elapsed_s).max(0.0);
        self.now()
    }
}
