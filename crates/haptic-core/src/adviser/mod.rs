//! What a scene will do to a rig before anybody feels it: the known bounds on stability, passivity
//! and chatter, each with its margin and with the value that would fix it.
//!
//! | check | bound | source |
//! |---|---|---|
//! | limit cycle | `V = 2 F(V) T / (4 M - K T^2 - 2 (B + b) T)`, literal scheme only; the exact scheme has none | derived from the scheme |
//! | least mass | `M >= K T^2/4 + (B + b) T/2`, literal scheme only | derived from the scheme |
//! | ripple | `V (K T/2 + B)` felt by the hand, literal scheme only | derived from the scheme |
//! | passivity | `b_rig >= K (T/2 + tau) + B` | Colgate and Schenkel 1997, with a delay |
//! | linear stability | the characteristic polynomial of the sampled loop, block stuck; for a rig of unknown mass that of a heavy one, `K <= 2 (b_rig + B) / (T + 2 tau)` | linear analysis; with delay Gil, Sanchez, Hulin, Preusche and Hirzinger 2009 |
//! | friction | `b_rig + f/v >= K (T/2 + tau) + B`: the rig's own Coulomb friction takes up what sampling creates up to the speed v | energy per period |
//! | encoder | `f >= (K/2 + B/T) Delta`: the same for what counting creates | Abbott and Okamura 2005, with damping |
//! | friction passivity | `b >= sigma1 (Fs/Fd - 1)`, LuGre and elasto-plastic: else the law itself can give out energy | Barabanov and Ortega 2000 |
//!
//! `T` is the time between two forces that differ: the longer of the loop's period and of the
//! device's, since a force from an old sample is the old force again. `tau` is the time from a
//! sample to the motor that knows it. Behind a link it is measured: the round trip, from a
//! command's sending to the arrival of the first sample that knows it, is at most a period longer
//! than the path there and back, so it bounds `tau` from above; what the newest sample's age exceeds
//! a period of each side by comes on top, because then samples come late or are lost. A force that
//! holds for `T` acts `T/2` late in the mean, and so the two add up to `T/2 + tau`. In the first
//! three, `T` is the step of the scheme, which the device does not change, `F(V)` the friction at
//! the speed of the cycle, and `F` and `b` are the means of both directions. With a limit that rises
//! in rest, a curve that begins at it is that of a long rest.
//!
//! Passivity, friction and encoder are about the worst hand: one that goes straight from sample to
//! sample, at whatever frequency up to half the rate, and no faster than `v` where that counts. The
//! velocity is that of two samples there. Linear stability has the true velocity: an estimator
//! that lags takes stability away, as a delay does.
//!
//! [`stick_slip()`] says how often a block lets go of a hand that keeps its speed.
//!
//! On the device itself, without a block, `K` is the stiffness of the contact and `B` its damping
//! and drag. The first three are about the scheme, the others about the hand in the loop. Those are
//! sufficient or necessary for worst cases: a rig whose hand damps well may do fine beyond them,
//! which is why this advises and does not refuse.

mod finding;
mod hand_in_the_loop;
mod literal_scheme;
mod rig_facts;
mod sampled;
mod stick_slip;

pub use finding::{Check, Finding, Fix};
pub use rig_facts::{LinkTimes, RigFacts};
pub use stick_slip::{StickSlip, StickSlipError, static_force_for, stick_slip, stiffness_for};

use crate::directional::{Direction, Directional};
use crate::parameters::Parameter;
use crate::scene::Scene;
use crate::scheme::Scheme;
use alloc::vec::Vec;
use finding::{About, DAMPING_UNIT, at_least};
use hand_in_the_loop::Stability;

/// Speed, m/s, at which the rig's own friction is held against what sampling creates: the fastest
/// that a hand usually goes when it explores.
pub const EXPLORING_SPEED_MPS: f64 = 0.1;

/// Ripple, N, that a hand does not feel in this band.
pub const UNFELT_RIPPLE_N: f64 = 0.05;

/// Limit cycle, m/s, below which a block counts as at rest.
pub const UNSEEN_LIMIT_CYCLE_MPS: f64 = 1e-4;

/// Holds a valid scene against every bound that concerns it. Pure: the same scene on the same rig
/// gives the same advice. A value that would break another bound is no fix.
#[must_use]
pub fn advise(scene: &Scene, scheme: Scheme, rig: &RigFacts) -> Vec<Finding> {
    let mut findings = findings(scene, scheme, rig, Stability::Bound);
    let is_kept = |findings: &[Finding], check| findings.iter().all(|of| of.check != check || of.passes);
    for index in 0..findings.len() {
        // A softer spring breaks nothing.
        let springs = [Parameter::Stiffness, Parameter::ContactStiffness];
        let fix = findings[index].fix.filter(|fix| !springs.contains(&fix.parameter));
        let fixed = fix.and_then(|fix| scene.with(&[(fix.parameter.into(), fix.value)]).ok());
        let breaks_another = fixed.is_some_and(|fixed| {
            let after = self::findings(&fixed, scheme, rig, Stability::Holds);
            after.iter().any(|of| !of.passes && is_kept(&findings, of.check))
        });
        if breaks_another {
            findings[index].fix = None;
        }
    }
    findings
}

fn findings(scene: &Scene, scheme: Scheme, rig: &RigFacts, stability: Stability) -> Vec<Finding> {
    let mut findings = Vec::with_capacity(8);
    if let Scheme::Literal { substeps } = scheme {
        literal_scheme::check(scene, substeps, rig.period_s, &mut findings);
    }
    hand_in_the_loop::check(scene, rig, stability, &mut findings);
    friction_passivity(scene, &mut findings);
    findings
}

fn friction_passivity(scene: &Scene, findings: &mut Vec<Finding>) {
    let forces = [Parameter::StaticForce, Parameter::DynamicForce, Parameter::Viscous];
    let symmetric = forces
        .iter()
        .all(|force| scene.value(*force).is_none_or(Directional::is_symmetric));
    let drag = scene.value(Parameter::Viscous).unwrap_or_default();
    let directions = if symmetric {
        &Direction::BOTH[..1]
    } else {
        &Direction::BOTH
    };
    for &direction in directions {
        let Some(bound) = scene.friction.as_law().passive_from(direction) else {
            return;
        };
        let about = About {
            check: Check::FrictionPassivity,
            parameter: Parameter::Viscous,
            unit: DAMPING_UNIT,
            fixed_by: bound.is_finite().then_some(bound),
        };
        findings.push(at_least(about, drag.get(direction), bound.max(0.0)));
    }
}

#[cfg(test)]
mod tests;
