//! The scene that the rig renders, as far as a session knows.

use haptic_core::Scene;
use haptic_ipc::Sample;

/// The scene that the rig renders.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ActiveScene {
    /// Nobody has reported it.
    Unknown,
    /// The change to this scene is on its way.
    Requested(Scene),
    /// It is this one.
    Known {
        scene: Scene,
        revision: u64,
        /// The first tick that renders it alone.
        whole_tick: u64,
    },
}

impl ActiveScene {
    /// Whether the caller shall change to a scene; the change is on its way then.
    pub(super) fn request(&mut self, wanted: &Scene) -> bool {
        let is_due = match self {
            Self::Unknown => true,
            Self::Requested(_) => false,
            Self::Known { scene, .. } => scene != wanted,
        };
        if is_due {
            *self = Self::Requested(wanted.clone());
        }
        is_due
    }

    /// Takes it that the change that was on its way was made.
    pub(super) fn rendered(&mut self, revision: u64, whole_tick: u64) {
        if let Self::Requested(scene) = std::mem::replace(self, Self::Unknown) {
            *self = Self::Known {
                scene,
                revision,
                whole_tick,
            };
        }
    }

    /// The scene and its revision, where a tick renders it alone.
    pub(super) fn whole(&self, row: &Sample) -> Option<(&Scene, u64)> {
        match self {
            Self::Known {
                scene,
                revision,
                whole_tick,
            } if row.revision == *revision && row.tick >= *whole_tick => Some((scene, *revision)),
            _ => None,
        }
    }

    /// Whether a tick renders this scene alone.
    pub(super) fn is_whole(&self, wanted: &Scene, row: &Sample) -> bool {
        self.whole(row).is_some_and(|(scene, _)| scene == wanted)
    }

    /// Whether a tick renders a scene that somebody else has set.
    pub(super) fn is_foreign(&self, row: &Sample) -> bool {
        matches!(self, Self::Known { revision, whole_tick, .. } if row.tick >= *whole_tick && row.revision != *revision)
    }
}
