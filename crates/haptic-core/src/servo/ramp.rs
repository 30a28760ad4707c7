//! Compiles a scene, and the way to it where it shall take its time. Not for the real-time thread.
//!
//! A recording holds the scenes and the time, and no step between them: whoever compiles them again
//! gets the same steps.

use super::transition::{CompiledScene, Steps, Transition};
use crate::{Renderer, Scene, SceneError, Scheme};
use alloc::vec::Vec;

/// Scenes that a way is made of at most: a force moves by less than a hundredth of its range in
/// one.
const MOST_STEPS: f64 = 250.0;

impl CompiledScene {
    /// Compiles a scene that takes `ramp_s` seconds to come in from another, for ticks of about
    /// `period_s` seconds. Without that time it comes in at once.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub fn ramped(
        from: &Scene,
        to: &Scene,
        revision: u64,
        scheme: Scheme,
        period_s: f64,
        ramp_s: f64,
    ) -> Result<Self, SceneError> {
        let compile = |scene: &Scene| Renderer::new(scene, scheme, period_s);
        let renderer = compile(to)?;
        if ramp_s <= 0.0 {
            return Ok(Self::at_once(renderer, revision));
        }
        let Some(first) = from.toward(to, 0.0) else {
            return Ok(Self {
                renderer,
                revision,
                transition: Transition::Fade { over_s: ramp_s },
            });
        };
        let count = libm::ceil(ramp_s / period_s).min(MOST_STEPS);
        let mut on_the_way = Vec::new();
        let mut step = 1.0;
        while step < count {
            // What cannot be rendered between two scenes that can is passed over.
            if let Some(Ok(renderer)) = from.toward(to, step / count).as_ref().map(compile) {
                on_the_way.push(renderer);
            }
            step += 1.0;
        }
        on_the_way.push(renderer);
        Ok(Self {
            // The scene from which it comes has been rendered before.
            renderer: compile(&first).or_else(|_| compile(to))?,
            revision,
            transition: Transition::Steps(Steps::new(on_the_way, ramp_s)),
        })
    }
}
