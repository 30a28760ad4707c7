//! The exact tick against true motions: the project's own reference solver, first held against the
//! stored references, then used on the hard cases.

use haptic_core::{Parameter, Scene, Scheme};
use haptic_lab::accuracy::cases::{self, Case, OscillatingHand, changed};
use haptic_lab::accuracy::reference::solve;
use haptic_lab::accuracy::{RunError, compare};
use haptic_lab::motion::{self, DeviceSample};
use haptic_lab::simulate::{ContactChange, Simulation, Start, simulate};
use proptest::prelude::*;
use std::path::Path;

fn stored(name: &str) -> (Vec<DeviceSample>, Vec<[f64; 3]>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../haptic-core/tests/data/reference")
        .join(format!("{name}.csv"));
    let truth = std::fs::read_to_string(&path)
        .expect("the fixture")
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            [cells[3], cells[5], cells[6]]
        })
        .collect();
    (motion::read(&path).expect("a motion"), truth)
}

#[test]
fn the_reference_solver_gives_the_stored_references() {
    for (name, changes, start) in [
        ("paper", vec![], 0.0),
        ("high-stiction", vec![("Fs", 7.0)], 0.0),
        ("viscous", vec![("Fs", 0.0), ("Fd", 0.0), ("b", 35.0)], 0.0),
        ("free-motion", vec![("Fs", 4.0), ("Fd", 4.0)], 0.5),
        ("light-block-10g", vec![("M", 0.01)], 0.0),
        ("slow-ramp-stick-slip", vec![("K", 500.0), ("B", 2.0)], 0.0),
    ] {
        let (motion, truth) = stored(name);
        let start = Start {
            velocity_mps: start,
            ..Start::default()
        };
        let run = solve(&changed(&changes), &motion, start);
        for (row, [position, force, contact]) in run.rows.iter().zip(truth) {
            assert!((row.block_position_m - position).abs() <= 2e-17, "{name}: {row:?}");
            assert!((row.coupling_force_n - force).abs() <= 1e-12, "{name}: {row:?}");
            assert_eq!(f64::from(row.contact.as_number()), contact, "{name}: {row:?}");
        }
    }
}

#[test]
fn the_exact_tick_is_true_on_the_hard_cases() {
    let mut failures = Vec::new();
    for case in cases::of_karnopp() {
        let (run, truth, error) = both(&case);
        println!("{:26} {error:?}, {} events", case.name, truth.events.len());
        let good = error.position_m <= 1e-12
            && error.relative_force <= 1e-9
            && error.event_time_s.is_some_and(|time| time <= 1e-12);
        if !good || run.energy_created_j != 0.0 || run.exhausted_ticks != 0 {
            failures.push(case.name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// The exact tick's run of a case, the true one, and how far they are apart.
fn both(case: &Case) -> (Simulation, Simulation, RunError) {
    let truth = solve(&case.scene, &case.motion, case.start);
    let run = simulate(&case.scene, Scheme::Exact, &case.motion, case.start).expect("a valid scene");
    let error = compare(&run, &truth, case.stiffness());
    (run, truth, error)
}

/// Whether the exact tick renders a case as truly as its law allows.
fn is_true(case: &Case) -> bool {
    let (run, truth, error) = both(case);
    println!(
        "{:36} {error:?}, {} events, {:.0e} J created",
        case.name,
        truth.events.len(),
        run.energy_created_j
    );
    let linear = ["viscous", "karnopp, rising", "dahl, i = 0,", "reset", "salcudean"];
    let good = if linear.iter().any(|law| case.name.starts_with(law)) {
        // Pieces of straight lines: exact, changes of contact and all.
        error.relative_force <= 1e-9 && error.position_m <= 1e-12
    } else if case.name.starts_with("lugre") || case.name.starts_with("elasto") {
        // Missed ticks and jumps under the stiffest of laws: the tick's bounded work is used,
        // and exactness relaxed.
        error.force_n <= 1e-2
    } else {
        error.force_n <= 1e-3
    };
    // What friction is seen to create is the error of the quadrature that measures it.
    good && run.exhausted_ticks == 0 && run.energy_created_j <= 1e-7
}

/// Under smooth hands `by_law` holds every law to its limits.
#[test]
fn every_other_law_is_true_under_a_rough_hand() {
    // In a short run the hand goes one way, turns round, and is on its way back.
    let samples = test_run::extent(200, 300);
    let is_rough = |case: &Case| case.name.ends_with("rough hand") || case.name.contains("loaded");
    let mut cases: Vec<Case> = cases::of_laws().into_iter().filter(is_rough).collect();
    cases.iter_mut().for_each(|case| case.motion.truncate(samples));
    let failures: Vec<&str> = cases
        .iter()
        .filter(|case| !is_true(case))
        .map(|case| &*case.name)
        .collect();
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn a_tick_may_hold_a_hundred_and_forty_changes_of_contact() {
    // 387 rad a millisecond, and next to nothing that takes the swing away; the first tick comes 15 % late.
    let scene = changed(&[("M", 2e-5), ("K", 3e6), ("B", 0.0), ("Fs", 0.1), ("Fd", 0.1)]);
    let motion: Vec<DeviceSample> = (0..5)
        .map(|k| DeviceSample {
            t_s: f64::from(k) * 1e-3 + if k > 0 { 0.15e-3 } else { 0.0 },
            ..DeviceSample::default()
        })
        .collect();
    let start = Start {
        velocity_mps: 10.0,
        ..Start::default()
    };
    let truth = solve(&scene, &motion, start);
    let run = simulate(&scene, Scheme::Exact, &motion, start).expect("a valid scene");
    let in_the_first_tick = run.events.iter().filter(|event| event.t_s < 1.15e-3).count();
    println!("{in_the_first_tick} changes of contact");
    assert!(in_the_first_tick >= 141);
    let error = compare(&run, &truth, 3e6);
    assert!(error.position_m <= 1e-12 && error.relative_force <= 1e-9, "{error:?}");
    assert!(error.event_time_s.is_some_and(|time| time <= 1e-12), "{error:?}");
    assert_eq!((run.energy_created_j, run.exhausted_ticks), (0.0, 0));
}

#[test]
fn grazing_stop_found_or_missed_leaves_force_unchanged() {
    // A slide that the hand slows down and then speeds up again: where it keeps enough speed, the
    // block does not stop in between. With one limit for both, a stop of no time changes nothing.
    let scene = changed(&[("K", 2000.0), ("B", 5.0), ("Fs", 3.5)]);
    let run = |least_speed: f64| {
        let hand: Vec<DeviceSample> = (0..100)
            .map(|k| {
                let t = f64::from(k) * 1e-3 - 0.03;
                DeviceSample {
                    t_s: f64::from(k) * 1e-3,
                    position_m: 3.5 / 2000.0 + least_speed * t + 100.0 * t.powi(3),
                    velocity_mps: least_speed + 300.0 * t.powi(2),
                }
            })
            .collect();
        let start = Start {
            position_m: Some(least_speed * -0.03 + 100.0 * (-0.03_f64).powi(3)),
            velocity_mps: least_speed + 300.0 * 0.0009,
        };
        let run = simulate(&scene, Scheme::Exact, &hand, start).expect("a valid scene");
        (run, solve(&scene, &hand, start))
    };
    let stops = |run: &Simulation| run.events.iter().any(|event| event.to.as_number() == 0);
    let (mut slow, mut fast) = (0.0, 2.0);
    assert!(stops(&run(slow).0) && !stops(&run(fast).0));
    for _ in 0..60 {
        let middle = 0.5 * (slow + fast);
        if stops(&run(middle).0) {
            slow = middle;
        } else {
            fast = middle;
        }
    }
    // The last digit decides between these two, and the force knows nothing of it.
    let ((stopped, _), (passed, _)) = (run(slow), run(fast));
    let error = compare(&stopped, &passed, 2000.0);
    println!("stops where the hand slows to {slow} m/s, not at {fast} m/s: {error:?}");
    assert!(error.force_n <= 1e-5, "{error:?}");
    // And a hair to either side all is as true as ever.
    for speed in [slow * (1.0 - 1e-6), fast * (1.0 + 1e-6)] {
        let (run, truth) = run(speed);
        let error = compare(&run, &truth, 2000.0);
        assert!(error.position_m <= 1e-12 && error.relative_force <= 1e-9, "{error:?}");
    }
}

#[test]
fn far_origin_costs_force_only_the_position_digits() {
    for origin in [1e3, 1e9] {
        let scene = Scene::paper();
        let hand = OscillatingHand {
            samples: 300,
            ..OscillatingHand::PLAIN
        };
        let mut far = hand.samples();
        far.iter_mut().for_each(|sample| sample.position_m += origin);
        let run = simulate(&scene, Scheme::Exact, &far, Start::default()).expect("a valid scene");
        let truth = solve(&scene, &far, Start::default());
        let error = compare(&run, &truth, 25_000.0);
        println!("{origin}: {error:?}");
        let digit = origin * f64::EPSILON;
        assert!(error.force_n <= 25_000.0 * 100.0 * digit.max(1e-16), "{error:?}");
        assert_eq!(run.energy_created_j, 0.0);
    }
}

/// A run without the contacts that last no time. A swing that nothing damps, or a force that comes
/// back to exactly its limit, touches zero and does not cross it: whether that is a stop is for the
/// last digit to say, in the reference as well.
fn without_touches(mut run: Simulation) -> Simulation {
    let mut kept: Vec<ContactChange> = Vec::with_capacity(run.events.len());
    for event in run.events {
        let touched = |last: &ContactChange| last.from == event.to && event.t_s - last.t_s < 1e-8;
        if kept.last().is_some_and(touched) {
            kept.pop();
        } else {
            kept.push(event);
        }
    }
    run.events = kept;
    run
}

/// A number from each decade of a range alike, or exactly zero now and then.
fn decades(low: f64, high: f64, zero: u32) -> impl Strategy<Value = f64> {
    prop_oneof![
        zero => Just(0.0),
        10 => (low..high).prop_map(|exponent: f64| 10_f64.powf(exponent)),
    ]
}

prop_compose! {
    fn any_scene()(
        mass in decades(-3.0, 1.0, 0),
        stiffness in decades(1.0, 6.0, 1),
        damping in decades(-2.0, 2.0, 1),
        plus in decades(-1.0, 1.3, 1),
        minus in decades(-1.0, 1.3, 1),
        share in prop_oneof![Just(1.0), Just(0.0), 0.0..1.0],
        viscous in decades(-1.0, 1.5, 3),
        threshold in prop_oneof![2 => Just(0.0), 1 => 0.0..0.3],
    ) -> Option<Scene> {
        let changes = [
            ("M", mass), ("K", stiffness), ("B", damping), ("Fs+", plus), ("Fs-", minus), ("Fd+", plus * share),
            ("Fd-", minus * share), ("b+", viscous), ("b-", 0.3 * viscous), ("DV", threshold),
        ].map(|(name, value)| (name.parse().expect("a parameter"), value));
        Scene::paper().with(&changes).ok()
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: test_run::extent(40, 300),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn the_exact_tick_is_true_on_any_scene(
        scene in any_scene(),
        frequency_hz in 0.5..20.0,
        jitter in prop_oneof![Just(0.0), Just(0.3)],
        encoder_m in prop_oneof![Just(0.0), Just(1e-5)],
        jump_every in prop_oneof![2 => Just(0_usize), 1 => 5_usize..40],
    ) {
        let Some(scene) = scene else { return Ok(()) };
        let hand = OscillatingHand {
            frequency_hz,
            jitter,
            encoder_m,
            jump_every,
            amplitude_m: 0.03 / frequency_hz,
            samples: 120,
            ..OscillatingHand::PLAIN
        };
        let motion = hand.samples();
        let truth = solve(&scene, &motion, Start::default());
        let run = simulate(&scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        let (run, truth) = (without_touches(run), without_touches(truth));
        prop_assert_eq!(run.energy_created_j, 0.0);
        // A swing without any loss comes back to rest under exactly the force that set it off:
        // whether it sticks there is a matter of the last digit, and the two ways part.
        let least = |parameter| scene.value(parameter).expect("it has it").least();
        let coupling = scene.coupling.expect("a coupling");
        let undamped = coupling.damping + least(Parameter::Viscous) == 0.0;
        if undamped && least(Parameter::DynamicForce) == 0.0 {
            return Ok(());
        }
        prop_assert_eq!(run.exhausted_ticks, 0, "{:?}", scene);
        let error = compare(&run, &truth, coupling.stiffness);
        prop_assert!(error.position_m <= 1e-12 && error.relative_force <= 1e-9, "{scene:?}: {error:?}");
        // Where one limit is zero, a block at rest under no force is exactly at its limit: again
        // the last digit decides.
        if least(Parameter::StaticForce) == 0.0 {
            return Ok(());
        }
        // The time at which a velocity touches zero is good to the root of rounding only.
        let tolerance_s = if undamped { 1e-7 } else { 1e-12 };
        let same_events = error.event_time_s.is_some_and(|time| time <= tolerance_s);
        prop_assert!(same_events, "{scene:?}: {error:?}, {:?} {:?}", run.events, truth.events);
    }
}
