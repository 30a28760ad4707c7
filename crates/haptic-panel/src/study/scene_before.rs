//! The scene that was active before a study changed it: the study's end puts it back.

use super::rig_facts::RigFacts;
use crate::intent::Intent;
use crate::update::{Answer, Update};
use haptic_core::Scene;

/// The scene before the study's first change, and the revision of the study's newest.
#[derive(Debug, Default)]
pub(super) struct SceneBefore {
    kept: Option<Scene>,
    own_revision: Option<u64>,
}

impl SceneBefore {
    /// Keeps the active scene, unless one is kept; returns whether one is.
    pub(super) fn keep(&mut self, rig: &RigFacts) -> bool {
        if self.kept.is_none() {
            self.kept = rig.scene().cloned();
        }
        self.kept.is_some()
    }

    /// Takes an update: the revisions of the study's own changes.
    pub(super) fn take(&mut self, update: &Update) {
        if let Update::Answered {
            intent: Intent::TrialScene { .. },
            result: Ok(Answer::Changed(reply)),
        } = update
            && self.kept.is_some()
        {
            self.own_revision = Some(reply.revision);
        }
    }

    /// The change back, once; none where the study has changed nothing, or another client has changed the scene since.
    pub(super) fn put_back(&mut self, rig: &RigFacts, ramp_ms: f64) -> Option<Intent> {
        let (kept, own_revision) = (self.kept.take(), self.own_revision.take());
        let if_revision = own_revision.filter(|own| rig.revision == Some(*own))?;
        Some(Intent::TrialScene {
            scene: Box::new(kept?),
            if_revision,
            ramp_ms,
        })
    }
}
