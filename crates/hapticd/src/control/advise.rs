//! `advise`: what the active scene will do to the rig.

use crate::control::RigHandle;
use crate::control::rig::known_rig::KnownRig;
use haptic_core::Scene;
use haptic_core::adviser::{RigFacts, advise as look};
use haptic_ipc::{Advice, AdviceReply};
use std::cell::RefCell;
use std::time::{Duration, Instant};

/// Largest age of the bounds in `status`: to reckon them takes up to some milliseconds of the thread that hears stops.
const MAX_KEPT: Duration = Duration::from_secs(1);

/// The bounds that a scene broke, with its revision and when they were reckoned.
#[derive(Debug, Default)]
pub(super) struct BrokenBounds(RefCell<Option<(u64, Instant, Vec<String>)>>);

pub(super) fn advise(rig: &RigHandle) -> AdviceReply {
    let (facts, basis) = rig.known.advice_basis();
    AdviceReply {
        revision: rig.revision(),
        advice: all(&rig.known, &rig.scene(), &facts),
        basis: Some(basis),
    }
}

/// Every check and every remark on a scene for a rig.
fn all(rig: &KnownRig, scene: &Scene, facts: &RigFacts) -> Vec<Advice> {
    let notes = scene.notes().into_iter().map(Advice::from);
    let findings = look(scene, rig.facts.scheme, facts).into_iter().map(Advice::from);
    notes.chain(findings).collect()
}

/// The checks that the active scene fails, by name.
pub(super) fn broken_bounds(rig: &RigHandle) -> Vec<String> {
    let revision = rig.revision();
    let mut kept = rig.known.broken_bounds.0.borrow_mut();
    if let Some((of, at, bounds)) = &*kept
        && *of == revision
        && at.elapsed() < MAX_KEPT
    {
        return bounds.clone();
    }
    let findings = look(&rig.scene(), rig.facts.scheme, &rig.known.advice_basis().0);
    let broken = findings.into_iter().filter(|finding| !finding.passes);
    let bounds: Vec<String> = broken.map(|finding| finding.check.name().to_owned()).collect();
    *kept = Some((revision, Instant::now(), bounds.clone()));
    bounds
}

/// The remarks, and the checks that a scene fails.
pub(super) fn warnings(rig: &KnownRig, scene: &Scene) -> Vec<Advice> {
    let mut advice = all(rig, scene, &rig.advice_basis().0);
    advice.retain(|advice| advice.finding.as_ref().is_none_or(|finding| !finding.passes));
    advice
}
