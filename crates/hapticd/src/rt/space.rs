//! The space that the hand moves in, a line or a plane: what the loop and the hand-over have to tell apart.
//!
//! The loop is compiled for each. What goes between the threads is of one type: a scene says which it is of, and a
//! record holds the first axis, before which that of the second goes on its own.

use haptic_core::planar::Plane;
use haptic_core::servo::{CompiledScene, Transition};
use haptic_core::{Scene, SceneError, Scheme, Vector};

/// A line or a plane, as a type.
pub(crate) trait Space: Vector {
    /// A direction of the plane, of the length 1; on a line there is only one.
    fn direction(in_plane: Plane) -> Self;

    /// A scene of this space.
    ///
    /// # Errors
    /// The scene is of the other one.
    fn own(scene: CompiledIn) -> Result<Box<CompiledScene<Self>>, CompiledIn>;

    /// The same as one of either space.
    fn either(scene: Box<CompiledScene<Self>>) -> CompiledIn;
}

/// The first axis, along which a rig of one axis moves.
pub(crate) const FIRST_AXIS: Plane = Plane::new(1.0, 0.0);

/// A compiled scene of either space.
#[derive(Debug)]
pub(crate) enum CompiledIn {
    Line(Box<CompiledScene>),
    Plane(Box<CompiledScene<Plane>>),
}

impl Space for f64 {
    fn direction(_: Plane) -> Self {
        1.0
    }

    fn own(scene: CompiledIn) -> Result<Box<CompiledScene>, CompiledIn> {
        match scene {
            CompiledIn::Line(scene) => Ok(scene),
            CompiledIn::Plane(_) => Err(scene),
        }
    }

    fn either(scene: Box<CompiledScene>) -> CompiledIn {
        CompiledIn::Line(scene)
    }
}

impl Space for Plane {
    fn direction(in_plane: Plane) -> Self {
        in_plane
    }

    fn own(scene: CompiledIn) -> Result<Box<CompiledScene<Self>>, CompiledIn> {
        match scene {
            CompiledIn::Plane(scene) => Ok(scene),
            CompiledIn::Line(_) => Err(scene),
        }
    }

    fn either(scene: Box<CompiledScene<Self>>) -> CompiledIn {
        CompiledIn::Plane(scene)
    }
}

impl CompiledIn {
    /// Compiles a scene for a line, or for a plane: [`CompiledScene::ramped`].
    ///
    /// # Errors
    /// The scene cannot be rendered there.
    pub(crate) fn ramped(
        is_plane: bool,
        from: &Scene,
        to: &Scene,
        scheme: Scheme,
        period_s: f64,
        ramp_s: f64,
    ) -> Result<Self, SceneError> {
        // The revision is known when it is handed over.
        Ok(if is_plane {
            Self::Plane(Box::new(CompiledScene::ramped(from, to, 0, scheme, period_s, ramp_s)?))
        } else {
            Self::Line(Box::new(CompiledScene::ramped(from, to, 0, scheme, period_s, ramp_s)?))
        })
    }

    /// Number of the scene.
    #[cfg(test)]
    pub(crate) fn revision(&self) -> u64 {
        match self {
            Self::Line(scene) => scene.revision,
            Self::Plane(scene) => scene.revision,
        }
    }

    /// The same with a number.
    pub(crate) fn numbered(mut self, revision: u64) -> Self {
        match &mut self {
            Self::Line(scene) => scene.revision = revision,
            Self::Plane(scene) => scene.revision = revision,
        }
        self
    }

    /// How many scenes lead to it, with itself; 0 where it takes effect at once or fades in.
    pub(crate) fn steps(&self) -> usize {
        fn steps<V: Vector>(scene: &CompiledScene<V>) -> usize {
            match &scene.transition {
                Transition::Steps(steps) => steps.count(),
                Transition::AtOnce | Transition::Fade { .. } => 0,
            }
        }
        match self {
            Self::Line(scene) => steps(scene),
            Self::Plane(scene) => steps(scene),
        }
    }
}

impl<V: Space> From<CompiledScene<V>> for CompiledIn {
    fn from(scene: CompiledScene<V>) -> Self {
        V::either(Box::new(scene))
    }
}
