//! How a scene takes effect: at once, in small steps, or by fading over from the one before.
//!
//! Steps are whole scenes between the two, compiled elsewhere: each is put in place as a new scene
//! is, and nothing is computed, allocated or freed for it. Between scenes of different laws there
//! are no scenes; both are rendered for a while, and the force goes over from one to the other.

use crate::Renderer;
use crate::snapshot::Archive;
use alloc::boxed::Box;
use alloc::vec::Vec;

/// A scene, ready to be rendered.
#[derive(Debug)]
pub struct CompiledScene {
    /// What is rendered; while the scene takes effect step by step, the step that it has reached.
    pub renderer: Renderer,
    /// Number of the scene.
    pub revision: u64,
    /// How it takes effect.
    pub transition: Transition,
}

impl CompiledScene {
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
    pub fn at_once(renderer: Renderer, revision: u64) -> Self {
        Self {
            renderer,
            revision,
            transition: Transition::AtOnce,
        }
    }
}

/// How a scene takes effect.
#[derive(Debug, Default)]
pub enum Transition {
    /// In the step that takes it.
    #[default]
    AtOnce,
    /// Through scenes on the way, the last of them the scene itself.
    Steps(Steps),
    /// By fading over from the force of the one before.
    Fade {
        /// Time that it takes, s.
        over_s: f64,
    },
}

/// Scenes on the way from one to another, at equal distances in time.
#[derive(Debug)]
pub struct Steps {
    /// Those yet to come; in the places of those that came, the ones that they replaced.
    renderers: Vec<Renderer>,
    taken: usize,
    over_s: f64,
    gone_s: f64,
}

impl Steps {
    /// The scenes after the first one, of which the last is the scene itself, over a time, s.
    #[must_use]
    pub fn new(renderers: Vec<Renderer>, over_s: f64) -> Self {
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
    pub(super) fn advance(&mut self, elapsed_s: f64, current: &mut Renderer) -> Option<f64> {
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
    pub(super) fn finish(&mut self, current: &mut Renderer) {
        // Without force on the hand there is no step of it to let in.
        if self.take(self.renderers.len(), current).is_some() {
            self.gone_s = self.over_s;
        }
    }

    fn take(&mut self, due: usize, current: &mut Renderer) -> Option<f64> {
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
pub(super) struct FadingScene {
    scene: Box<CompiledScene>,
    left_s: f64,
    over_s: f64,
    /// What it last added to the force of the incoming scene, N.
    excess: f64,
}

impl FadingScene {
    pub(super) fn is_motion(&self) -> bool {
        self.scene.renderer.is_motion()
    }

    /// Saves or loads how far it has faded.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("left_s", &mut self.left_s);
        archive.number("over_s", &mut self.over_s);
        archive.number("excess_N", &mut self.excess);
        self.scene.archive(archive);
    }

    pub(super) fn revision(&self) -> u64 {
        self.scene.revision
    }

    pub(super) fn new(scene: Box<CompiledScene>, over_s: f64) -> Self {
        Self {
            scene,
            left_s: over_s,
            over_s,
            excess: 0.0,
        }
    }

    /// What it last added to the force of the incoming scene, N.
    pub(super) fn excess(&self) -> f64 {
        self.excess
    }

    pub(super) fn into_scene(self) -> Box<CompiledScene> {
        self.scene
    }

    /// Lets a time go by, s; returns whether the fade is over.
    pub(super) fn is_over_after(&mut self, elapsed_s: f64) -> bool {
        self.left_s -= elapsed_s;
        self.left_s <= 0.0
    }

    /// What is left of its force, beyond that of the incoming scene, N.
    pub(super) fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64, incoming_force: f64) -> f64 {
        let force = self.scene.renderer.tick(elapsed_s, position, velocity).coupling_force;
        self.excess = (force - incoming_force) * (self.left_s / self.over_s);
        self.excess
    }
}
