//! Compiles a scene for the real-time thread: to one renderer, or to a ramp of them.

use haptic_core::servo::{CompiledScene, Steps, Transition};
use haptic_core::{Renderer, Scene, SceneError, Scheme};
use haptic_ipc::WireError;

/// Most scenes of a ramp: each moves the force by less than a hundredth of its range.
const MOST_STEPS: f64 = 250.0;

/// The steps of a ramp from one scene to another.
#[derive(Debug)]
pub(crate) struct RampPath {
    from: Scene,
    steps: usize,
}

impl RampPath {
    pub(super) fn steps(&self) -> usize {
        self.steps
    }

    /// The scene that it has reached after some of its steps.
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
    /// Compiles a scene and, if `ramp_s` (seconds) is not 0, the ramp to it from another.
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
            // A scene on the way that cannot be rendered is skipped, even if both ends can be.
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
            // The first scene has been rendered before.
            renderer: compile(&first).or_else(|_| compile(to))?,
            transition: Transition::Steps(Steps::new(on_the_way, ramp_s)),
            way: Some(way),
            ramp_ticks,
        })
    }

    /// Length of the ramp in ticks, if there is one.
    pub(super) fn ramp_ticks(&self) -> Option<u64> {
        self.ramp_ticks
    }

    /// The scene for the real-time thread, and its ramp if it has one.
    pub(crate) fn into_scene(self, revision: u64) -> (CompiledScene, Option<RampPath>) {
        let scene = CompiledScene {
            renderer: self.renderer,
            revision,
            transition: self.transition,
        };
        (scene, self.way)
    }
}
