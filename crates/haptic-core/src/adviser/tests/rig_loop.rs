//! A rig against a stuck block oscillates where the adviser says so, and not where it does not.

use super::{RIG, exact, wall};
use crate::adviser::{Check, RigFacts};
use crate::parameters::Parameter;
use crate::{Renderer, Scene, Scheme};
use proptest::prelude::*;

/// A rig whose motor gives the force of each sample after a delay, as long as the next one is not
/// there.
struct TestRig {
    facts: RigFacts,
    place: f64,
    speed: f64,
}

impl TestRig {
    /// Moves on under a constant force, N.
    fn advance(&mut self, time_s: f64, force: f64) {
        let (mass, damping) = (self.facts.mass.expect("a mass"), self.facts.damping);
        if damping == 0.0 {
            self.place += time_s * (self.speed + 0.5 * time_s * force / mass);
            self.speed += time_s * force / mass;
        } else {
            let (end, gone) = (force / damping, -(-damping * time_s / mass).exp_m1());
            self.place += end * time_s + (self.speed - end) * gone * mass / damping;
            self.speed += (end - self.speed) * gone;
        }
    }
}

/// By how much a push has grown, over a long run; below 1 where it dies away.
fn growth(scene: &Scene, facts: RigFacts) -> f64 {
    let t = facts.period_s;
    let mut wall = Renderer::new(scene, Scheme::Exact, t).expect("a valid scene");
    let mut rig = TestRig {
        facts,
        place: 0.0,
        speed: 1e-6,
    };
    let stiffness = scene.value(Parameter::Stiffness).expect("a coupling").positive;
    let whole = (0..)
        .take_while(|k| t * f64::from(k + 1) <= facts.delay_s + 1e-12)
        .count();
    let first = (facts.delay_s - whole as f64 * t).max(0.0);
    let mut forces = std::vec![0.0; whole + 2];
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    let ticks = 30_000;
    for tick in 0..ticks {
        forces.insert(0, -wall.tick(t, rig.place, rig.speed).coupling_force);
        forces.pop();
        let [.., newer, older] = forces.as_slice() else {
            unreachable!("there are two");
        };
        rig.advance(first, *older);
        rig.advance(t - first, *newer);
        let size = rig.speed.abs() + rig.place.abs() * (stiffness / facts.mass.expect("a mass")).sqrt();
        if size > 1e-3 {
            return f64::INFINITY;
        }
        if (ticks / 10..ticks / 5).contains(&tick) {
            early = early.max(size);
        } else if tick > ticks - ticks / 10 {
            late = late.max(size);
        }
    }
    // What has died away altogether is rounding.
    if early < 1e-15 { 0.0 } else { late / early }
}

#[test]
fn with_too_much_damping_no_stiffness_is_stable() {
    let rig = RigFacts {
        delay_s: 1e-3,
        mass: Some(0.3),
        ..RIG
    };
    let stability = |rig| exact(&wall(25_000.0, 500.0), rig, Check::LinearStability);
    let finding = stability(&rig);
    assert_eq!(
        (finding.parameter, finding.unit, finding.passes),
        (Parameter::Damping, "N s/m", false)
    );
    // z^2 - z + B T/m.
    assert!((finding.bound - 300.0).abs() < 1e-6, "{}", finding.bound);
    let fix = finding.fix.expect("less damping");
    assert!(fix.parameter == Parameter::Damping && fix.value < 300.0, "{fix:?}");
    assert!(growth(&wall(25_000.0, fix.value * 0.99), rig) < 1.0);
    assert!(growth(&wall(25_000.0, fix.value * 1.01), rig) > 1.0);
    for stiffness in [1.0, 1e3, 1e5] {
        assert!(growth(&wall(stiffness, 500.0), rig) > 1.0, "{stiffness} N/m");
    }
    // Without the mass it is not known.
    let unknown = RigFacts { mass: None, ..rig };
    let finding = stability(&unknown);
    assert!(finding.passes && (finding.bound - 1000.0 / 3e-3).abs() < 1e-6);
}

#[test]
fn a_heavy_rig_has_the_bound_of_the_formula() {
    for delay_s in [0.0, 1e-3, 2.4e-3, 0.082] {
        let of = |mass| {
            let rig = RigFacts { delay_s, mass, ..RIG };
            exact(&wall(1.0, 10.0), &rig, Check::LinearStability).bound
        };
        let ratio = of(Some(1000.0)) / of(None);
        assert!((ratio - 1.0).abs() < 1e-3, "{delay_s} s: {ratio}");
        assert!(of(Some(0.3)) < of(None) * (1.0 + 1e-9), "{delay_s} s");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(40, 300), rng_seed: proptest::test_runner::RngSeed::Fixed(36), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn just_inside_it_decays_and_just_outside_it_grows(
        mass in (-1.3..0.3f64).prop_map(|e| 10_f64.powf(e)), own in prop_oneof![Just(0.0), 0.0..20.0f64],
        share in 0.02..0.95f64, periods in prop_oneof![Just(0.0), Just(1.0), 0.0..6.0f64],
    ) {
        let rig = RigFacts { delay_s: periods * 1e-3, mass: Some(mass), damping: own, ..RIG };
        let found = |scene: &Scene| exact(scene, &rig, Check::LinearStability);
        // More than any rig bears.
        let most = found(&wall(1.0, 1e4)).bound;
        prop_assert!(growth(&wall(1.0, 0.98 * most), rig) <= 1.0, "damping {most}");
        prop_assert!(growth(&wall(1.0, 1.02 * most), rig) > 1.0, "damping {most}");
        let damping = share * most;
        let bound = found(&wall(1.0, damping)).bound;
        prop_assume!(bound < 3e6);
        for share in [0.03, 0.4, 0.97] {
            prop_assert!(growth(&wall(share * bound, damping), rig) < 1.0, "{share} of {bound} N/m, {damping} N s/m");
        }
        // A scene has 3 MN/m at most.
        for share in [1.03, 2.0].into_iter().filter(|share| share * bound < 3e6) {
            prop_assert!(growth(&wall(share * bound, damping), rig) > 1.0, "{share} of {bound} N/m, {damping} N s/m");
        }
    }
    /// In the plane a rig oscillates along the main axes of its mass, each by itself, and every mass lies between the
    /// lightest and the heaviest.
    #[test]
    fn what_two_masses_bear_any_between_them_bears(
        powers in (-1.5..1.0f64, -1.5..1.0f64), share in 0.0..1.0f64,
        own in prop_oneof![Just(0.0), 0.0..20.0f64], damping in prop_oneof![0.0..20.0f64, 0.0..300.0f64],
        periods in prop_oneof![Just(0.0), Just(1.0), 0.0..6.0f64],
    ) {
        let bears = |power: f64| {
            let rig = RigFacts { delay_s: periods * 1e-3, mass: Some(10_f64.powf(power)), damping: own, ..RIG };
            let found = exact(&wall(1.0, damping), &rig, Check::LinearStability);
            if found.unit == "N/m" { found.bound } else { 0.0 }
        };
        let least = bears(powers.0).min(bears(powers.1));
        let between = bears(powers.0 + share * (powers.1 - powers.0));
        prop_assert!(between >= 0.999 * least, "{between} N/m, and {least} N/m at the ends");
    }
}
