//! The scenes of a recording, compiled as the daemon compiled them.

use super::error::ReplayError;
use haptic_core::scene::{Coupling, SceneFile};
use haptic_core::servo::CompiledScene;
use haptic_core::{ParameterKey, Rendering, Scene, SceneError, Scheme, Vector};
use haptic_ipc::{SceneArrival, ServoSetup};
use haptic_recording::Metadata;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is rendered instead of what was. The default changes nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alternative {
    /// Another scene, in place of every one of the recording. Where the rig gives its coupling, it has that of the
    /// recording's first scene, and [`Coupling::CALM`] where that has none.
    pub scene: Option<SceneFile>,
    /// Other values of parameters, in every scene.
    pub changes: Vec<(ParameterKey, f64)>,
    /// Another scheme.
    pub scheme: Option<Scheme>,
}

impl Alternative {
    fn of(&self, scene: &Scene, of_rig: Option<Coupling>) -> Result<Scene, SceneError> {
        match &self.scene {
            Some(file) => file.clone().on(of_rig).with(&self.changes),
            None => scene.with(&self.changes),
        }
    }
}

/// The scene that a recorded revision brings.
#[derive(Debug)]
pub(super) enum IncomingScene<V: Vector> {
    Compiled(Box<CompiledScene<V>>),
    /// The alternative renders the same scene throughout.
    Unchanged,
    /// The recording does not hold it.
    Unknown,
}

/// All scenes of a recording so far.
#[derive(Clone, Debug)]
pub(super) struct Scenes {
    by_revision: BTreeMap<u64, Arc<SceneArrival>>,
    scheme: Scheme,
    recorded_scheme: Scheme,
    period_s: f64,
    alternative: Option<Alternative>,
    /// The coupling that the rig gives, as far as the recording shows it.
    of_rig: Option<Coupling>,
}

impl Scenes {
    pub(super) fn new(metadata: &Metadata, setup: &ServoSetup, alternative: Option<Alternative>) -> Self {
        let first = SceneArrival {
            scene: metadata.scene.clone(),
            ramp: None,
        };
        Self {
            by_revision: BTreeMap::from([(metadata.revision, Arc::new(first))]),
            scheme: alternative
                .as_ref()
                .and_then(|alternative| alternative.scheme)
                .unwrap_or(setup.scheme),
            recorded_scheme: setup.scheme,
            period_s: setup.settings.period_s,
            alternative,
            of_rig: metadata.scene.coupling,
        }
    }

    pub(super) fn add(&mut self, revision: u64, arrival: &SceneArrival) {
        self.by_revision.insert(revision, Arc::new(arrival.clone()));
    }

    /// How a scene came in, if the recording holds it.
    pub(super) fn arrival(&self, revision: u64) -> Option<&SceneArrival> {
        self.by_revision.get(&revision).map(|arrival| &**arrival)
    }

    /// The law of a scene, if the recording holds it.
    pub(super) fn law(&self, revision: u64) -> Option<&'static str> {
        let arrival = self.by_revision.get(&revision)?;
        Some(arrival.scene.friction.law())
    }

    /// A scene as it was compiled when it came in, without what is rendered instead.
    pub(super) fn recorded<V: Vector>(
        &self,
        revision: u64,
        arrival: &SceneArrival,
    ) -> Result<Box<CompiledScene<V>>, ReplayError> {
        let SceneArrival { scene, ramp } = arrival;
        let (from, ramp_s) = ramp.as_ref().map_or((scene, 0.0), |ramp| (&ramp.from, ramp.over_s));
        CompiledScene::ramped(from, scene, revision, self.recorded_scheme, self.period_s, ramp_s)
            .map(Box::new)
            .map_err(|error| ReplayError::Scene { revision, error })
    }

    /// An incoming scene, with its ramp.
    pub(super) fn incoming<V: Vector>(&self, revision: u64) -> Result<IncomingScene<V>, ReplayError> {
        let Some(arrival) = self.by_revision.get(&revision) else {
            return Ok(IncomingScene::Unknown);
        };
        let SceneArrival { scene, ramp } = &**arrival;
        if self.alternative.as_ref().is_some_and(|other| other.scene.is_some()) {
            return Ok(IncomingScene::Unchanged);
        }
        let (from, ramp_s) = ramp.as_ref().map_or((scene, 0.0), |ramp| (&ramp.from, ramp.over_s));
        let compile = || {
            let (from, to) = (self.changed(from)?, self.changed(scene)?);
            CompiledScene::ramped(&from, &to, revision, self.scheme, self.period_s, ramp_s)
        };
        let compiled = compile().map_err(|error| ReplayError::Scene { revision, error })?;
        Ok(IncomingScene::Compiled(Box::new(compiled)))
    }

    /// Whether a scene is rendered otherwise than it was.
    pub(super) fn is_otherwise(&self, revision: u64, scene: &Scene) -> Result<bool, ReplayError> {
        let changed = self
            .changed(scene)
            .map_err(|error| ReplayError::Scene { revision, error })?;
        Ok(self.scheme != self.recorded_scheme || changed != *scene)
    }

    /// A scene that has arrived; `None` if the recording does not hold it.
    pub(super) fn active<V: Vector>(&self, revision: u64) -> Result<Option<Box<CompiledScene<V>>>, ReplayError> {
        let Some(arrival) = self.by_revision.get(&revision) else {
            return Ok(None);
        };
        let renderer = self
            .changed(&arrival.scene)
            .and_then(|scene| V::Renderer::new(&scene, self.scheme, self.period_s))
            .map_err(|error| ReplayError::Scene { revision, error })?;
        Ok(Some(Box::new(CompiledScene::at_once(renderer, revision))))
    }

    fn changed(&self, scene: &Scene) -> Result<Scene, SceneError> {
        match &self.alternative {
            Some(alternative) => alternative.of(scene, self.of_rig),
            None => Ok(scene.clone()),
        }
    }
}
