//! From a scene to what the real-time thread takes: one renderer, or a whole way of them.

use haptic_core::servo::{CompiledScene, Steps, Transition};
use haptic_core::{Renderer, Scene, SceneError, Scheme};
use haptic_ipc::WireError;

/// Scenes that a way is made of at most: a force moves by less than a hundredth of its range in
/// one.
const MOST_STEPS: f64 = 250.0;

/// The way to a scene in steps.
#[derive(Debug)]
pub(crate) struct RampPath {
    from: Scene,
    steps: usize,
}

impl RampPath {
    pub(super) fn steps(&self) -> usize {
        self.steps
    }

    /// Where it has come to after some of its steps.
    pub(super) fn at(&self, taken: usize, to: &Scene) -> Scene {
        #[expect(clippy::cast_precision_loss, reason = "a few hundred steps")]
        let share = (taken as f64 / self.steps as f64).min(1.0);
        self.from.toward(to, share).unwrap_or_else(|| to.clone())
    }
}

/// A scene, ready to be handed over.
#[derive(Debug)]
pub(crate) struct Compiled {
    renderer: Renderer,
    transition: Transition,
    way: Option<RampPath>,
    ramp_ticks: Option<u64>,
}

impl Compiled {
    /// Compiles a scene and, where it shall take `ramp_s` seconds to get there, the way from
    /// another.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(crate) fn new(from: &Scene, to: &Scene, scheme: Scheme, period_s: f64, ramp_s: f64) -> Result<Self, WireError> {
        let compile = |scene: &Scene| -> Result<Renderer, SceneError> { Renderer::new(scene, scheme, period_s) };
        let renderer = compile(to)?;
        if ramp_s <= 0.0 {
            return Ok(Self {
                renderer,
                transition: Transition::AtOnce,
                way: None,
                ramp_ticks: None,
            });
        }
        let ticks = (ramp_s / period_s).ceil();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most ten seconds of ticks"
        )]
        let ramp_ticks = Some(ticks as u64);
        let Some(first) = from.toward(to, 0.0) else {
            return Ok(Self {
                renderer,
                transition: Transition::Fade { over_s: ramp_s },
                way: None,
                ramp_ticks,
            });
        };
        let count = ticks.min(MOST_STEPS);
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
        let way = RampPath {
            from: from.clone(),
            steps: on_the_way.len(),
        };
        Ok(Self {
            // The scene from which it comes has been rendered before.
            renderer: compile(&first).or_else(|_| compile(to))?,
            transition: Transition::Steps(Steps::new(on_the_way, ramp_s)),
            way: Some(way),
            ramp_ticks,
        })
    }

    /// Ticks that the way takes, where there is one.
    pub(super) fn ramp_ticks(&self) -> Option<u64> {
        self.ramp_ticks
    }

    /// What the real-time thread takes, and the way there, where it goes in steps.
    pub(crate) fn into_scene(self, revision: u64) -> (CompiledScene, Option<RampPath>) {
        let scene = CompiledScene {
            renderer: self.renderer,
            revision,
            transition: self.transition,
        };
        (scene, self.way)
    }
}
