//! The bounds come out as published, and what they say is so.

mod bristles;
mod literal_scheme;
mod rig_loop;
mod stick_slip;
mod wall;

use super::*;
use crate::parameters::ParameterKey;
use alloc::string::ToString;
use proptest::prelude::*;
use std::vec::Vec;

const RIG: RigFacts = RigFacts {
    period_s: 1e-3,
    sample_period_s: 0.0,
    delay_s: 0.0,
    mass: None,
    damping: 0.0,
    friction: 0.8,
    resolution: 1e-5,
};

fn find(findings: &[Finding], check: Check) -> Finding {
    *findings
        .iter()
        .find(|finding| finding.check == check)
        .expect("it is checked")
}

/// What is found of a check by the exact scheme.
fn exact(scene: &Scene, rig: &RigFacts, check: Check) -> Finding {
    find(&advise(scene, Scheme::Exact, rig), check)
}

/// The paper's scene with changes.
fn scene(changes: &[(&str, f64)]) -> Scene {
    let changes: Vec<(ParameterKey, f64)> = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("a parameter"), value))
        .collect();
    Scene::paper().with(&changes).expect("a valid scene")
}

/// A block that nothing moves.
fn wall(stiffness: f64, damping: f64) -> Scene {
    scene(&[("Fs", 1000.0), ("Fd", 1000.0), ("K", stiffness), ("B", damping)])
}

/// Numbers from -1 to 1 (xorshift, Marsaglia 2003).
fn random(seed: u64) -> impl Iterator<Item = f64> {
    core::iter::successors(Some(seed | 1), |state| {
        let mut next = *state;
        next ^= next << 13;
        next ^= next >> 7;
        next ^= next << 17;
        Some(next)
    })
    .map(|state| (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
}

#[test]
fn the_papers_numbers_come_out() {
    let scene = scene(&[("Fd", 4.0)]);
    let findings = advise(&scene, Scheme::LITERAL, &RIG);
    assert!((find(&findings, Check::LimitCycle).value - 4.0921e-3).abs() < 5e-8);
    assert!((find(&findings, Check::LeastMass).bound - 11.25e-3).abs() < 1e-15);
    assert!(find(&findings, Check::LeastMass).passes);
    // V (K T/2 + B) = 4.0921 mm/s x 22.5 N s/m.
    assert!((find(&findings, Check::Ripple).value - 0.092_07).abs() < 1e-5);
    // 2 (0 + 10) / 1 ms: the paper's stiffness is beyond it on a rig without damping, and
    // further with a tick of delay.
    let linear = find(&findings, Check::LinearStability);
    assert_eq!((linear.passes, linear.bound), (false, 20_000.0));
    let late = RigFacts { delay_s: 1e-3, ..RIG };
    let linear = exact(&scene, &late, Check::LinearStability);
    assert!((linear.bound - 20_000.0 / 3.0).abs() < 1e-9);
    // The exact scheme has no bounds of its own.
    let of_scheme = [Check::LimitCycle, Check::LeastMass, Check::Ripple];
    let findings = advise(&scene, Scheme::Exact, &RIG);
    assert!(!findings.iter().any(|found| of_scheme.contains(&found.check)));
    // 0.8 N at 0.1 m/s take up 8 N s/m, and B = 10 N s/m alone can give out more.
    assert_eq!(find(&findings, Check::Friction).bound, 0.0);
    let undamped = exact(&super::tests::scene(&[("B", 0.0)]), &RIG, Check::Friction);
    assert!((undamped.bound - 16_000.0).abs() < 1e-9);
    // 2 (0.8 N / 10 um - 10 N s/m / 1 ms).
    assert!((find(&findings, Check::Encoder).bound - 140_000.0).abs() < 1e-9);
}

// hazard: H10
#[test]
fn a_slow_rig_and_a_late_link_take_stiffness_away() {
    let bound = |times: LinkTimes| {
        let rig = RigFacts {
            sample_period_s: times.sample_period_s,
            delay_s: times.delay_s(RIG.period_s),
            ..RIG
        };
        exact(&Scene::paper(), &rig, Check::LinearStability).bound
    };
    // By 2 B / (T + 2 tau).
    for (rate_hz, round_trip_s, age_s, twice_late_s) in [
        // Nothing measured yet: a period of the slower side.
        (1000.0, 0.0, 0.0, 3e-3),
        (60.0, 0.0, 0.0, 3.0 / 60.0),
        (1000.0, 2e-3, 0.5e-3, 5e-3),
        (60.0, 1e-3, 17e-3, 1.0 / 60.0 + 2e-3),
        (60.0, 9e-3, 0.0, 1.0 / 60.0 + 18e-3),
        // Samples that come 5 ms too late are a delay like any other.
        (1000.0, 1e-3, 7e-3, 13e-3),
        // A rig that is faster than the loop is read once a tick all the same.
        (4000.0, 1e-3, 0.0, 3e-3),
    ] {
        let bound = bound(LinkTimes {
            sample_period_s: 1.0 / rate_hz,
            round_trip_s,
            age_s,
        });
        assert!((bound - 20.0 / twice_late_s).abs() < 1e-6, "{rate_hz} Hz: {bound}");
    }
}

#[test]
fn advice_names_the_values_and_the_fix() {
    let message = exact(&Scene::paper(), &RIG, Check::LinearStability).to_string();
    for part in ["25000 N/m", "20000 N/m", "stiffness = 20000 N/m would fix it"] {
        assert!(message.contains(part), "{message} lacks {part}");
    }
}

proptest! {
    #[test]
    fn the_fix_of_a_bound_fixes_it_and_breaks_no_other(
        mass in 1e-3..10.0f64, stiffness in 10.0..1e5f64, damping in 0.0..50.0f64, dynamic_force in 0.0..20.0f64,
        substeps in prop_oneof![Just(1), Just(10)], rig_damping in 0.0..50.0f64, delay_s in 0.0..3e-3f64, sample_period_s in 0.0..0.1f64,
    ) {
        let scene = scene(&[("M", mass), ("K", stiffness), ("B", damping), ("Fs", 20.0), ("Fd", dynamic_force)]);
        let rig = RigFacts { damping: rig_damping, delay_s, sample_period_s, ..RIG };
        let scheme = Scheme::Literal { substeps: core::num::NonZeroU32::new(substeps).expect("not zero") };
        let before = advise(&scene, scheme, &rig);
        for finding in &before {
            prop_assert_eq!(finding.passes, finding.margin >= 1.0, "{:?}", finding);
            if let Some(Fix { parameter, value }) = finding.fix {
                // A hair beyond, for rounding.
                let value = if parameter == Parameter::Mass { value * (1.0 + 1e-9) } else { value * (1.0 - 1e-9) };
                if let Ok(fixed) = scene.with(&[(parameter.into(), value)]) {
                    let after = advise(&fixed, scheme, &rig);
                    prop_assert!(find(&after, finding.check).passes, "{:?}", finding);
                    for of in after.iter().filter(|of| !of.passes) {
                        prop_assert!(!find(&before, of.check).passes, "{:?} breaks {:?}", finding, of);
                    }
                }
            }
        }
    }
}

#[test]
fn a_fix_that_breaks_another_bound_is_none() {
    let late = RigFacts {
        delay_s: 7e-3,
        damping: 1.95,
        ..RIG
    };
    let findings = advise(&scene(&[("K", 800.0), ("B", 10.0)]), Scheme::Exact, &late);
    let friction = find(&findings, Check::Friction);
    assert!(!friction.passes && find(&findings, Check::LinearStability).passes);
    assert_eq!(friction.fix, None, "less damping alone lets the loop oscillate");
    // With a known mass it is looked at, and not searched for.
    for mass in [0.2, 0.5, 1.0, 2.0, 5.0] {
        let rig = RigFacts {
            mass: Some(mass),
            ..late
        };
        for damping in 1..40 {
            let scene = scene(&[("K", 800.0), ("B", f64::from(damping))]);
            let before = advise(&scene, Scheme::Exact, &rig);
            for Fix { parameter, value } in before.iter().filter_map(|of| of.fix) {
                let fixed = scene.with(&[(parameter.into(), 0.999 * value)]).expect("a valid scene");
                for of in advise(&fixed, Scheme::Exact, &rig).iter().filter(|of| !of.passes) {
                    assert!(
                        !find(&before, of.check).passes,
                        "{mass} kg, {damping}: {parameter:?} breaks {of:?}"
                    );
                }
            }
        }
    }
    let text = friction.to_string();
    assert!(
        text.ends_with("no stiffness keeps it: damping must be below 9.9500 N s/m first"),
        "{text}"
    );
}

#[test]
fn a_bound_that_no_stiffness_keeps_says_what_would() {
    let light = RigFacts {
        damping: 1.0,
        friction: 0.15,
        ..RIG
    };
    let idle = RigFacts {
        damping: 0.0,
        friction: 0.0,
        ..RIG
    };
    let below = |damping: &str| alloc::format!("no stiffness keeps it: damping must be below {damping} N s/m first");
    let without = |what: &str| alloc::format!("no grip keeps it without {what} of the rig's own");
    for (rig, check, ends) in [
        (light, Check::Passivity, below("1.0000")),
        (light, Check::Friction, below("2.5000")),
        (light, Check::Encoder, below("15.00")),
        (idle, Check::Passivity, without("damping")),
        (idle, Check::Friction, without("friction or damping")),
        (idle, Check::Encoder, without("friction")),
    ] {
        let found = |stiffness, damping| exact(&wall(stiffness, damping), &rig, check);
        let broken = found(1e5, 20.0);
        assert!(!broken.passes && broken.to_string().ends_with(&ends), "{broken}");
        // And it would.
        if let Some(Fix { value, .. }) = broken.fixed_below.filter(|below| below.value > 0.0) {
            let softer = found(1e5, 0.9 * value).fix.map_or(1e5, |fix| 0.99 * fix.value);
            let mended = found(softer, 0.9 * value);
            assert!(mended.passes, "{mended}");
        }
        // A soft spring leaves something for a damper.
        let fix = found(500.0, 20.0).fix;
        assert_eq!(fix.is_none(), rig.damping + rig.friction == 0.0, "{check:?}");
        if let Some(Fix { parameter, value }) = fix {
            assert!(
                parameter == Parameter::Damping && found(500.0, value).passes,
                "{check:?}"
            );
        }
    }
}
