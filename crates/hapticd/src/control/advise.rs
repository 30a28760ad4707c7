//! `advise`: what the active scene will do to the rig.

use crate::control::RigHandle;
use crate::control::change::keyed;
use crate::control::rig::known_rig::KnownRig;
use haptic_core::adviser::{Check, Finding, RigFacts, advise as look};
use haptic_core::{Parameter, Scene};
use haptic_ipc::quantity::number;
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
    let beyond = beyond_the_force_limit(scene, rig.facts.force_limit().0);
    let notes = scene.notes().into_iter().map(Advice::from).chain(beyond);
    let findings = findings(rig, scene, facts, basis).into_iter().map(|finding| {
        let at = place(basis, finding.check);
        let mut advice = Advice::from(finding);
        advice.message.extend(at.map(|at| format!(", {at}")));
        advice
    });
    notes.chain(findings).collect()
}

/// The friction that is more than the rig is sent, N.
fn beyond_the_force_limit(scene: &Scene, limit_n: f64) -> Vec<Advice> {
    let mut beyond = Vec::new();
    for (parameter, and) in [
        (
            Parameter::StaticForce,
            ", and can move the handle before the friction lets go",
        ),
        (Parameter::DynamicForce, ""),
    ] {
        let Some(force) = scene.value(parameter) else { continue };
        let too_large = keyed(parameter, force)
            .into_iter()
            .filter(|(_, force_n)| *force_n > limit_n);
        beyond.extend(too_large.map(|(key, force_n)| Advice {
            param: key.to_string(),
            message: format!(
                "{key} = {} N is above the force limit of {} N: the hand feels no more than that{and}",
                number(force_n),
                number(limit_n)
            ),
            finding: None,
        }));
    }
    beyond
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

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::friction::{Friction, LAWS};

    #[test]
    fn friction_beyond_the_force_limit_is_reported_of_every_law() {
        let messages = |scene: &Scene, limit_n: f64| -> Vec<String> {
            let beyond = beyond_the_force_limit(scene, limit_n);
            beyond.into_iter().map(|advice| advice.message).collect()
        };
        for law in LAWS {
            let scene = Scene {
                friction: Friction::default_of(law).expect("a law of the list"),
                ..Scene::paper()
            };
            for parameter in [Parameter::StaticForce, Parameter::DynamicForce] {
                let Some(force) = scene.value(parameter) else { continue };
                let (most, name) = (force.greatest(), parameter.info().name);
                let is_named = |limit_n| messages(&scene, limit_n).iter().any(|message| message.contains(name));
                assert!(is_named(0.9 * most) && !is_named(most), "{name} of {law}");
            }
        }
        let forces = [("Fs", 9.0), ("Fd", 1.0)].map(|(name, value)| (name.parse().expect("a parameter"), value));
        let scene = Scene::paper().with(&forces).expect("a valid scene");
        assert_eq!(
            messages(&scene, 3.0),
            [
                "static_force = 9 N is above the force limit of 3 N: the hand feels no more than that, and can move the \
              handle before the friction lets go"
            ]
        );
        let one_way = [("Fs-".parse().expect("a parameter"), 2.0)];
        let scene = scene.with(&one_way).expect("a valid scene");
        assert!(matches!(&messages(&scene, 3.0)[..], [one] if one.starts_with("static_force+ = 9 N")));
    }
}
