//! Bounds of the loop through the hand and the rig: the force that a scene gives for a sample comes
//! late, and holds.

use super::EXPLORING_SPEED_MPS;
use super::finding::{About, Check, DAMPING_UNIT, Finding, Fix, at_least, at_most};
use super::rig_facts::RigFacts;
use super::sampled::{RigLoop, Sampled};
use crate::directional::Directional;
use crate::parameters::Parameter;
use crate::scene::Scene;
use alloc::vec::Vec;

/// How far inside its bound a damping is proposed: its digits are read by people, rounded.
const INSIDE: f64 = 0.99;

/// What the hand holds: a spring and a damper.
#[derive(Clone, Copy, Debug)]
struct Grip {
    stiffness: f64,
    damping: f64,
    /// The parameters of both.
    spring: Parameter,
    damper: Parameter,
}

impl Grip {
    /// The coupling, or the contact where there is none.
    fn of(scene: &Scene) -> Self {
        if let Some(coupling) = &scene.coupling {
            return Self {
                stiffness: coupling.stiffness,
                damping: coupling.damping,
                spring: Parameter::Stiffness,
                damper: Parameter::Damping,
            };
        }
        let greatest = |parameter| scene.value(parameter).map_or(0.0, Directional::greatest);
        let (drag, contact) = (greatest(Parameter::Viscous), greatest(Parameter::ContactDamping));
        Self {
            stiffness: scene.friction.contact_stiffness(true),
            damping: drag.max(contact),
            spring: Parameter::ContactStiffness,
            damper: if contact > drag {
                Parameter::ContactDamping
            } else {
                Parameter::Viscous
            },
        }
    }

    /// A check that a softer spring would fix, of such a stiffness.
    fn softer(&self, check: Check, unit: &'static str, to: f64) -> About {
        About {
            check,
            parameter: if self.stiffness > 0.0 { self.spring } else { self.damper },
            unit,
            fixed_by: (to > 0.0 && self.stiffness > 0.0).then_some(to),
        }
    }

    /// A finding of the energy that a grip gives out, which no stiffness mends from a damping on (N s/m, 0 where the rig
    /// takes up nothing). A smaller one does, by as much as the stiffness gives out in `late_s`, if that is less.
    fn mended_below(&self, damping: f64, late_s: f64, finding: Finding) -> Finding {
        if finding.passes || finding.fix.is_some() {
            return finding;
        }
        let left = damping - self.stiffness * late_s;
        let fix = |value| Fix {
            parameter: self.damper,
            value,
        };
        Finding {
            fix: (left > 0.0).then(|| fix(INSIDE * left)),
            fixed_below: Some(fix(damping)),
            ..finding
        }
    }

    /// A bound on the stiffness.
    fn stiffest(&self, check: Check, bound: f64) -> Finding {
        at_most(self.softer(check, "N/m", bound), self.stiffness, bound)
    }
}

/// What is asked of the loop against a stuck block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stability {
    /// How far it is from oscillating: that takes a search.
    Bound,
    /// Whether it oscillates.
    Holds,
}

pub(super) fn check(scene: &Scene, rig: &RigFacts, stability: Stability, findings: &mut Vec<Finding>) {
    let (grip, t) = (Grip::of(scene), rig.effective_period_s());
    let times = Sampled::new(t, rig.delay_s);
    // What is left for the spring of a damping that takes up.
    let softened = |takes_up: f64| ((takes_up - grip.damping) / times.lateness_s()).max(0.0);
    let passivity = at_least(
        grip.softer(Check::Passivity, DAMPING_UNIT, softened(rig.damping)),
        rig.damping,
        times.damping_needed(grip.stiffness, grip.damping),
    );
    findings.push(grip.mended_below(rig.damping, times.lateness_s(), passivity));
    findings.extend(match stability {
        Stability::Bound => linear_stability(&grip, times, rig),
        Stability::Holds => holds(&grip, times, rig),
    });
    if grip.stiffness == 0.0 {
        return;
    }
    let takes_up = rig.damping + rig.friction / EXPLORING_SPEED_MPS;
    let friction = grip.stiffest(Check::Friction, softened(takes_up));
    findings.push(grip.mended_below(takes_up, times.lateness_s(), friction));
    if rig.resolution > 0.0 {
        let bound = 2.0 * (rig.friction / rig.resolution - grip.damping / t);
        let encoder = grip.stiffest(Check::Encoder, bound.max(0.0));
        findings.push(grip.mended_below(rig.friction / rig.resolution * t, 0.5 * t, encoder));
    }
}

/// `None` where neither spring nor mass is known.
fn linear_stability(grip: &Grip, times: Sampled, rig: &RigFacts) -> Option<Finding> {
    let Some(mass) = rig.mass else {
        let bound = 2.0 * (rig.damping + grip.damping) / (rig.effective_period_s() + 2.0 * rig.delay_s);
        return (grip.stiffness > 0.0).then(|| grip.stiffest(Check::LinearStability, bound));
    };
    let rig = RigLoop::new(mass, rig.damping, times);
    let most = rig.greatest_damping();
    if grip.damping <= most {
        let bound = || rig.greatest_stiffness(grip.damping);
        return (grip.stiffness > 0.0).then(|| grip.stiffest(Check::LinearStability, bound()));
    }
    let about = About {
        check: Check::LinearStability,
        parameter: grip.damper,
        unit: DAMPING_UNIT,
        fixed_by: rig.greatest_damping_for(grip.stiffness, most),
    };
    Some(at_most(about, grip.damping, most))
}

/// The same without its bound.
fn holds(grip: &Grip, times: Sampled, rig: &RigFacts) -> Option<Finding> {
    let Some(mass) = rig.mass else {
        return linear_stability(grip, times, rig);
    };
    let holds = RigLoop::new(mass, rig.damping, times).holds(grip.stiffness, grip.damping);
    let bound = if holds { f64::INFINITY } else { f64::NEG_INFINITY };
    Some(grip.stiffest(Check::LinearStability, bound))
}
