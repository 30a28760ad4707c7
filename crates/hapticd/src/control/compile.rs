//! Compiles a scene for the real-time thread, and keeps its ramp.

use haptic_core::servo::{CompiledScene, Transition};
use haptic_core::{Scene, Scheme};
use haptic_ipc::{SceneRamp, WireError};

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
    scene: CompiledScene,
    ramp: Option<SceneRamp>,
    ramp_ticks: Option<u64>,
}

impl Compiled {
    /// Compiles a scene and, if `ramp_s` (seconds) is not 0, the ramp to it from another.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(crate) fn new(from: &Scene, to: &Scene, scheme: Scheme, period_s: f64, ramp_s: f64) -> Result<Self, WireError> {
        // The revision is known when it is handed over.
        let scene = CompiledScene::ramped(from, to, 0, scheme, period_s, ramp_s)?;
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

    /// Length of the ramp in ticks, if there is one.
    pub(super) fn ramp_ticks(&self) -> Option<u64> {
        self.ramp_ticks
    }

    /// Its ramp.
    pub(super) fn ramp(&self) -> Option<&SceneRamp> {
        self.ramp.as_ref()
    }

    /// How many scenes it holds: itself, and those on the way to it.
    pub(super) fn count(&self) -> usize {
        match &self.scene.transition {
            Transition::Steps(steps) => 1 + steps.count(),
            _ => 1,
        }
    }

    /// The scene for the real-time thread, and its ramp if it has one.
    pub(crate) fn into_scene(self, revision: u64) -> (CompiledScene, Option<RampPath>) {
        let way = match (self.ramp, &self.scene.transition) {
            (Some(ramp), Transition::Steps(steps)) => Some(RampPath {
                from: ramp.from,
                steps: steps.count(),
            }),
            _ => None,
        };
        let scene = CompiledScene { revision, ..self.scene };
        (scene, way)
    }
}
