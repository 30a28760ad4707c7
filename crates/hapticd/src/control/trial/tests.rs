//! Rigs that chatter and rigs that do not.

use super::course::TrialRig;
use super::gentler::{FACTOR, gentler, rounded_down, stable_stiffness, stiffest_coupling};
use super::{LIGHT_RIG_KG, MAX_SIGN_CHANGES_PER_S, Trial, TrialHand, worst_trial};
use crate::rt::tick::tests::SETTINGS;
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::scene::Coupling;
use haptic_core::servo::Settings;
use haptic_core::{Directional, Scene, Scheme};

/// A rig that is read and written in the same tick, at 1 kHz.
fn rig(mass_kg: f64, friction_n: f64, force_limit_n: f64) -> TrialRig {
    TrialRig {
        settings: Settings {
            ramp_s: 0.2,
            limits: Limits {
                force_n: force_limit_n,
                ..Limits::default()
            },
            losses: RigLosses {
                damping: 0.0,
                friction: friction_n,
            },
            stale_ns: 20_000_000,
            enable_button: Some(1),
            ..SETTINGS
        },
        scheme: Scheme::Exact,
        force_limit_n,
        sample_period_s: 0.0,
        delay_s: 0.0,
        resolution_m: 1e-5,
        mass_kg,
        friction_n: Directional::both(friction_n),
        damping_ns_per_m: 0.0,
    }
}

/// Light, with a weak motor and next to no friction.
fn hapkit() -> TrialRig {
    rig(0.1, 0.15, 5.0)
}

/// The fake rig, with its damper.
fn damped() -> TrialRig {
    TrialRig {
        damping_ns_per_m: 12.0,
        ..rig(1.4, 0.8, 20.0)
    }
}

/// A rig behind a link of 1 kHz.
fn behind_a_link(delay_s: f64, rig: TrialRig) -> TrialRig {
    TrialRig {
        delay_s,
        sample_period_s: 1e-3,
        ..rig
    }
}

/// A light rig of no friction there.
fn light_and_late(delay_s: f64) -> TrialRig {
    behind_a_link(delay_s, rig(LIGHT_RIG_KG, 0.0, 20.0))
}

fn changed(scene: &Scene, values: &[(&str, f64)]) -> Scene {
    let key = |name: &str| name.parse().expect("a parameter");
    let values: Vec<_> = values.iter().map(|(name, value)| (key(name), *value)).collect();
    scene.with(&values).expect("a valid scene")
}

fn coupled(stiffness: f64, damping: f64) -> Scene {
    changed(&Scene::paper(), &[("K", stiffness), ("B", damping)])
}

fn worst(scene: &Scene, rig: &TrialRig) -> Trial {
    worst_trial(scene, rig).expect("a valid scene").expect("three hands")
}

// hazard: H30
#[test]
fn what_jumps_to_one_side_would_chatter() {
    let scene = |stiffness| changed(&coupled(stiffness, 10.0), &[("mass", 0.1)]);
    let jumps = worst(&scene(4e5), &damped());
    assert!(jumps.sign_changes_per_s <= MAX_SIGN_CHANGES_PER_S, "{jumps}");
    assert!(
        !jumps.is_calm() && jumps.to_string().contains("its force jumps"),
        "{jumps}"
    );
    let quiet = worst(&scene(2e4), &damped());
    assert!(quiet.is_calm(), "{quiet}");
}

// hazard: H30
#[test]
fn what_oscillates_by_itself_would_chatter() {
    let slow = TrialRig {
        delay_s: 0.082,
        ..rig(1.4, 0.8, 20.0)
    };
    let coarse = TrialRig {
        resolution_m: 1e-4,
        ..rig(0.1, 0.1, 20.0)
    };
    let at_60_hz = TrialRig {
        sample_period_s: 1.0 / 60.0,
        delay_s: 1.0 / 60.0,
        ..rig(1.4, 0.8, 20.0)
    };
    for (what, rig) in [
        ("a light rig", hapkit()),
        ("82 ms there and back", slow),
        ("an encoder of 100 um", coarse),
        ("a USB link", behind_a_link(2e-3, rig(0.3, 0.2, 20.0))),
        ("60 samples a second", at_60_hz),
    ] {
        let trial = worst(&Scene::paper(), &rig);
        println!("{what}: {trial}");
        assert!(!trial.is_calm(), "{what}: {trial}");
    }
}

#[test]
fn what_damps_itself_is_calm() {
    for (what, scene, rig) in [
        ("a soft grip of a light rig", coupled(2000.0, 1.0), hapkit()),
        ("the paper's on the fake rig", Scene::paper(), rig(1.4, 0.8, 20.0)),
        ("a damped rig", coupled(1000.0, 10.0), damped()),
        ("a light rig behind a link", coupled(1000.0, 10.0), light_and_late(2e-3)),
        ("a rig without force", Scene::paper(), rig(0.1, 0.15, 0.0)),
    ] {
        let trial = worst(&scene, &rig);
        println!("{what}: {trial}");
        assert!(trial.is_calm(), "{what}: {trial}");
    }
}

#[test]
fn the_calm_grip_of_a_late_link_is_calm_on_a_light_rig() {
    for delay_ms in 1..=28_u32 {
        let late = light_and_late(f64::from(delay_ms) * 1e-3);
        let scene = Scene {
            coupling: Some(Coupling::calm_behind(late.delay_s).unwrap_or(Coupling::CALM)),
            ..Scene::light_block()
        };
        let trial = worst(&scene, &late);
        assert!(trial.is_calm(), "{delay_ms} ms, {:?}: {trial}", scene.coupling);
    }
    assert_eq!(
        [0.0, 6e-3, 0.029, 0.082, f64::INFINITY, f64::NAN].map(Coupling::calm_behind),
        [None; 6],
        "as ever, and too late for any"
    );
}

#[test]
fn a_mirrored_scene_on_a_mirrored_rig_has_the_same_verdict() {
    let mirrored = |value: Directional| Directional::new(value.negative, value.positive);
    let lopsided = Directional::new(0.1, 0.6);
    for (stiffness, damping) in [(2000.0, 1.0), (8000.0, 4.0), (25_000.0, 10.0)] {
        let forces = Directional::new(4.0, 1.5);
        let with = |forces| Scene {
            friction: Friction::Karnopp(Karnopp::new(forces, forces)),
            ..coupled(stiffness, damping)
        };
        let one = TrialRig {
            friction_n: lopsided,
            ..hapkit()
        };
        let other = TrialRig {
            friction_n: mirrored(lopsided),
            ..one
        };
        let (one, other) = (worst(&with(forces), &one), worst(&with(mirrored(forces)), &other));
        assert_eq!(one.is_calm(), other.is_calm(), "{one}; mirrored, {other}");
    }
}

#[test]
fn a_gentler_grip_is_calm_and_twice_as_stiff_a_one_too() {
    for rig in [
        hapkit(),
        TrialRig {
            delay_s: 0.082,
            ..rig(1.4, 0.8, 20.0)
        },
    ] {
        let changes = gentler(&Scene::paper(), &rig).expect("there is one");
        for factor in [0.5, 1.0, FACTOR] {
            let changes: Vec<_> = changes.iter().map(|(key, value)| (*key, factor * value)).collect();
            let scene = Scene::paper().with(&changes).expect("a valid scene");
            let trial = worst(&scene, &rig);
            assert!(trial.is_calm(), "{changes:?}: {trial}");
        }
    }
    assert_eq!(
        [0.0, 1234.0, 0.0999, 50.0].map(rounded_down),
        [0.0, 1200.0, 0.099, 50.0]
    );
}

#[test]
fn a_rig_that_would_fault_is_not_calm() {
    let trial = worst(&coupled(5000.0, 10.0), &light_and_late(0.01));
    assert!(trial.fault.is_some() && !trial.is_calm(), "{trial}");
    assert!(trial.to_string().contains("ends in a fault"), "{trial}");
    // That a hand goes faster than a rig allows says nothing of the scene.
    let mut slow = rig(1.4, 0.8, 20.0);
    slow.settings.limits.speed_mps = 0.02;
    let trial = worst(&Scene::paper(), &slow);
    assert!(trial.is_calm(), "{trial}");
}

#[test]
fn figures_are_printed_with_their_hand() {
    let trial = Trial {
        hand: TrialHand::Absent,
        sign_changes_per_s: MAX_SIGN_CHANGES_PER_S + 105.0,
        jumps_per_s: 0.0,
        share_at_limit: 0.78,
        greatest_force_n: 5.0,
        rests: false,
        fault: None,
    };
    assert_eq!(
        trial.to_string(),
        "left alone it changes sign 125 times a second, up to 5.00 N and 78 % of the time at the rig's limit, and \
         does not come to rest"
    );
}

#[test]
fn the_stiffest_grip_of_a_rig_is_calm_with_a_factor_to_spare() {
    let mut stiffest = f64::INFINITY;
    for rig in [rig(1.4, 0.8, 20.0), hapkit(), light_and_late(2e-3)] {
        let Coupling { stiffness, damping } = stiffest_coupling(&[rig]).expect("there is one");
        let trial = worst(&coupled(FACTOR * stiffness, damping), &rig);
        assert!(trial.is_calm(), "{stiffness} N/m, {damping} N s/m: {trial}");
        assert!(
            stiffness < stiffest && stiffness > 500.0,
            "{stiffness} N/m, {damping} N s/m"
        );
        stiffest = stiffness;
    }
}

#[test]
fn a_grip_of_a_rig_of_unknown_mass_holds_for_every_mass() {
    let with_drag = TrialRig {
        damping_ns_per_m: 1.0,
        ..rig(LIGHT_RIG_KG, 0.15, 20.0)
    };
    // Drag that its pulses take for friction.
    for rig in [rig(LIGHT_RIG_KG, 0.21, 20.0), with_drag, hapkit()] {
        let Coupling { stiffness, damping } = stiffest_coupling(&rig.of_every_mass()).expect("there is one");
        let twice = coupled(FACTOR * stiffness, damping);
        for mass_kg in [0.05, 0.07, 0.1, 0.2, 0.5, 1.0, 3.0] {
            let rig = TrialRig { mass_kg, ..rig };
            let trial = worst(&twice, &rig);
            assert!(
                trial.is_calm(),
                "{mass_kg} kg, {stiffness} N/m, {damping} N s/m: {trial}"
            );
            let bound = stable_stiffness(damping, &rig);
            assert!(
                FACTOR * stiffness <= bound,
                "{mass_kg} kg, {stiffness} N/m, {damping} N s/m: {bound} N/m"
            );
        }
    }
}

// hazard: H30
#[test]
fn a_block_that_swings_only_while_it_slides_would_chatter() {
    let fake = damped();
    for static_n in [4.0, 7.0, 15.0] {
        let gripped = |stiffness| changed(&coupled(stiffness, 10.0), &[("Fs", static_n)]);
        let trial = worst(&gripped(150e3), &fake);
        assert!(
            trial.hand == TrialHand::Moving && !trial.is_calm(),
            "{static_n} N: {trial}"
        );
        let changes = gentler(&gripped(150e3), &fake).expect("there is one");
        let twice: Vec<_> = changes.iter().map(|(key, value)| (*key, FACTOR * value)).collect();
        let trial = worst(&gripped(150e3).with(&twice).expect("a valid scene"), &fake);
        assert!(trial.is_calm(), "{twice:?}: {trial}");
    }
    // Held or nudged, this one is calm; torn loose, it swings with all of the motor's force.
    let trial = worst(&changed(&coupled(97e3, 10.0), &[("Fs", 7.0)]), &fake);
    assert!(!trial.is_calm(), "{trial}");
    let trial = worst(&changed(&Scene::light_block(), &[("K", 300e3)]), &fake);
    assert!(!trial.is_calm(), "{trial}");
}
