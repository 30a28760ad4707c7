//! `advise`: what the active scene will do to the rig.

use crate::control::{RigHandle, rig_friction};
use haptic_core::Scene;
use haptic_core::adviser::advise as look;
use haptic_ipc::{Advice, AdviceReply};

pub(super) fn advise(rig: &RigHandle) -> AdviceReply {
    AdviceReply {
        revision: rig.revision(),
        advice: all(rig, &rig.scene()),
        basis: Some(rig_friction::advice_basis(rig)),
    }
}

/// Every check and every remark on a scene.
fn all(rig: &RigHandle, scene: &Scene) -> Vec<Advice> {
    let notes = scene.notes().into_iter().map(Advice::from);
    let findings = look(scene, rig.facts.scheme, &rig_friction::rig_facts(rig))
        .into_iter()
        .map(Advice::from);
    notes.chain(findings).collect()
}

/// The remarks, and the checks that a scene fails.
pub(super) fn warnings(rig: &RigHandle, scene: &Scene) -> Vec<Advice> {
    let mut advice = all(rig, scene);
    advice.retain(|advice| advice.finding.as_ref().is_none_or(|finding| !finding.passes));
    advice
}
