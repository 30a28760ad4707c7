//! `advise`: what the active scene will do to the rig.

use crate::control::RigHandle;
use crate::control::rig::known_rig::KnownRig;
use haptic_core::Scene;
use haptic_core::adviser::{Check, Finding, RigFacts, advise as look};
use haptic_ipc::{Advice, AdviceBasis, AdviceReply, WorstPlace};
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
        advice: all(&rig.known, &rig.scene(), &facts, &basis),
        basis: Some(basis),
    }
}

/// Every check and every remark on a scene for a rig.
fn all(rig: &KnownRig, scene: &Scene, facts: &RigFacts, basis: &AdviceBasis) -> Vec<Advice> {
    let notes = scene.notes().into_iter().map(Advice::from);
    let findings = findings(rig, scene, facts, basis).into_iter().map(|finding| {
        let at = place(basis, finding.check);
        let mut advice = Advice::from(finding);
        advice.message.extend(at.map(|at| format!(", {at}")));
        advice
    });
    notes.chain(findings).collect()
}

/// Every check of a scene. What oscillates with the heaviest mass of a rig of two axes need not with the lightest, and
/// the other way round.
fn findings(rig: &KnownRig, scene: &Scene, facts: &RigFacts, basis: &AdviceBasis) -> Vec<Finding> {
    let findings = look(scene, rig.facts.scheme, facts);
    let Some(heaviest_kg) = basis.heaviest_mass_kg else {
        return findings;
    };
    let heaviest = RigFacts {
        mass: Some(heaviest_kg),
        ..*facts
    };
    let others = look(scene, rig.facts.scheme, &heaviest);
    let worse = |(one, other): (Finding, Finding)| if other.margin < one.margin { other } else { one };
    findings.into_iter().zip(others).map(worse).collect()
}

/// Where on a rig of two axes a check is decided.
fn place(basis: &AdviceBasis, check: Check) -> Option<WorstPlace> {
    match check {
        Check::LinearStability => basis.mass_at,
        Check::Friction => basis.friction_at,
        Check::Encoder => basis.resolution_at,
        _ => None,
    }
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
    let (facts, basis) = rig.known.advice_basis();
    let findings = findings(&rig.known, &rig.scene(), &facts, &basis);
    let broken = findings.into_iter().filter(|finding| !finding.passes);
    let bounds: Vec<String> = broken.map(|finding| finding.check.name().to_owned()).collect();
    *kept = Some((revision, Instant::now(), bounds.clone()));
    bounds
}

/// The remarks, and the checks that a scene fails.
pub(super) fn warnings(rig: &KnownRig, scene: &Scene) -> Vec<Advice> {
    let (facts, basis) = rig.advice_basis();
    let mut advice = all(rig, scene, &facts, &basis);
    advice.retain(|advice| advice.finding.as_ref().is_none_or(|finding| !finding.passes));
    advice
}
