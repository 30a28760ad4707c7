//! `advise`: what the active scene will do to the rig.

use crate::control::{RigHandle, rig_friction};
use haptic_core::Scene;
use haptic_core::adviser::{RigFacts, advise as look};
use haptic_ipc::{Advice, AdviceReply};

pub(super) fn advise(rig: &RigHandle) -> AdviceReply {
    let facts = rig_friction::rig_facts(rig);
    AdviceReply {
        revision: rig.revision(),
        advice: all(rig, &rig.scene(), &facts),
        basis: Some(rig_friction::advice_basis(rig, &facts)),
    }
}

/// Every check and every remark on a scene for a rig.
fn all(rig: &RigHandle, scene: &Scene, facts: &RigFacts) -> Vec<Advice> {
    let notes = scene.notes().into_iter().map(Advice::from);
    let findings = look(scene, rig.facts.scheme, facts).into_iter().map(Advice::from);
    notes.chain(findings).collect()
}

/// The remarks, and the checks that a scene fails.
pub(super) fn warnings(rig: &RigHandle, scene: &Scene) -> Vec<Advice> {
    let mut advice = all(rig, scene, &rig_friction::rig_facts(rig));
    advice.retain(|advice| advice.finding.as_ref().is_none_or(|finding| !finding.passes));
    advice
}
