//! How a scene comes in: at once, in small steps, or by fading over from the one before.
//!
//! Steps are whole scenes between the two, compiled beforehand on the control thread: on the real-time thread each is put in place as a new scene is, and
//! nothing is computed, allocated or freed for it. Scenes of different laws have nothing in between; there both are rendered for a while,
//! and the force goes over from one to the other.

use haptic_core::Renderer;

/// How a scene comes in.
#[derive(Debug, Default)]
pub(crate) enum Transition {
    /// In the tick that takes it.
    #[default]
    AtOnce,
    /// Through scenes on the way, the last of them the scene itself.
    Steps(Steps),
    /// Out of the force of the one before, in so many seconds.
    Fade {
        /// How long, s.
        over_s: f64,
    },
}

/// Scenes on the way from one to another, at equal distances in time.
#[derive(Debug)]
pub(crate) struct Steps {
    /// Those yet to come, and in the places of those that were, what they replaced.
    renderers: Vec<Renderer>,
    taken: usize,
    over_s: f64,
    gone_s: f64,
}

impl Steps {
    /// The scenes after the first one, the last being where it leads to, over so many seconds.
    pub(crate) fn new(renderers: Vec<Renderer>, over_s: f64) -> Self {
        Self {
            renderers,
            taken: 0,
            over_s,
            gone_s: 0.0,
        }
    }

    /// Steps taken so far.
    pub(crate) fn taken(&self) -> usize {
        self.taken
    }

    /// Goes on by a time; puts the scene that is then due in the place of `current`. Returns the step of force that must be let in slowly, N, where there
    /// was a new scene.
    pub(crate) fn advance(&mut self, elapsed_s: f64, current: &mut Renderer) -> Option<f64> {
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
    pub(crate) fn finish(&mut self, current: &mut Renderer) {
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
        std::mem::swap(next, current);
        Some(step)
    }
}
