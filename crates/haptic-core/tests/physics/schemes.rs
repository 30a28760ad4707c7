//! Known behaviour of the two schemes: the literal one's limit cycle and divergence, and the
//! exact one's lack of both.

use haptic_core::block::{BlockState, Contact};
use haptic_core::parameters::{Parameter, ParameterKey};
use haptic_core::{Direction, Renderer, Scene, Scheme};
use proptest::prelude::*;

const T: f64 = 1e-3;

fn scene(changes: &[(&str, f64)]) -> Scene {
    let changes: Vec<(ParameterKey, f64)> = changes
        .iter()
        .map(|&(name, value)| (name.parse().expect("a parameter"), value))
        .collect();
    Scene::paper().with(&changes).expect("a valid scene")
}

fn renderer(scene: &Scene, scheme: Scheme, position: f64, velocity: f64) -> Renderer {
    let mut renderer = Renderer::new(scene, scheme, T).expect("a valid scene");
    renderer.set_state(BlockState::new(position, velocity, 0.0, 0.0));
    renderer
}

/// Amplitude of the literal scheme's limit cycle, from two states a tick apart (derived from the
/// scheme).
fn limit_cycle(mass: f64, stiffness: f64, damping: f64, dynamic_force: f64) -> f64 {
    2.0 * dynamic_force * T / (4.0 * mass - stiffness * T * T - 2.0 * damping * T)
}

#[test]
fn the_literal_scheme_ends_in_its_limit_cycle() {
    let scene = scene(&[("Fs", 4.0), ("Fd", 4.0)]);
    let mut block = renderer(&scene, Scheme::LITERAL, 0.0, 0.5);
    let mut last = 0.0;
    for _ in 0..20_000 {
        last = block.state().velocity;
        block.tick(T, 0.0, 0.0);
    }
    let now = block.state().velocity;
    let expected = limit_cycle(0.5, 25_000.0, 10.0, 4.0);
    assert!((expected - 4.0921e-3).abs() < 5e-8, "{expected}");
    assert!((now.abs() - expected).abs() <= 1e-12 * expected, "{now} for {expected}");
    assert!((now + last).abs() <= 1e-12 * expected, "it alternates: {last}, {now}");
}

#[test]
fn the_exact_scheme_comes_to_rest_instead() {
    let scene = scene(&[("Fs", 4.0), ("Fd", 4.0)]);
    let mut block = renderer(&scene, Scheme::Exact, 0.0, 0.5);
    for _ in 0..1000 {
        block.tick(T, 0.0, 0.0);
    }
    let resting = block.state();
    assert_eq!((resting.contact, resting.velocity), (Contact::Stuck, 0.0));
    for _ in 0..60_000 {
        block.tick(T, 0.0, 0.0);
    }
    assert_eq!(block.state().position, resting.position, "a stuck block does not creep");
}

/// Largest excursion of a block that is let go with 0.1 m/s at a device that stands still.
fn excursion(scheme: Scheme, mass: f64) -> f64 {
    let scene = scene(&[("mass", mass), ("Fs", 4.0), ("Fd", 4.0)]);
    let mut block = renderer(&scene, scheme, 0.0, 0.1);
    let mut most: f64 = 0.0;
    for _ in 0..20_000 {
        block.tick(T, 0.0, 0.0);
        most = most.max(block.state().position.abs());
    }
    most
}

#[test]
fn literal_scheme_diverges_below_least_mass_exact_does_not() {
    // M_min = K T^2/4 + (B + b) T/2 = 11.25 g.
    assert!(excursion(Scheme::LITERAL, 11.24e-3) > 1.0);
    assert!(excursion(Scheme::LITERAL, 11.26e-3) < 0.1);
    for mass in [1e-6, 11.24e-3, 11.26e-3] {
        assert!(excursion(Scheme::Exact, mass) < 1e-3, "{mass} kg");
    }
}

#[test]
fn larger_threshold_gives_more_stick_slip() {
    // A ramp so fast that the ideal block's slides hardly fall to rest.
    let slips = |threshold: f64| {
        let scene = scene(&[("K", 500.0), ("B", 2.0), ("DV", threshold)]);
        let mut block = renderer(&scene, Scheme::Exact, 0.0, 0.0);
        let speed = 0.02;
        let (mut breakaways, mut worst) = (0, 0.0_f64);
        block.set_state(BlockState::new(0.0, 0.0, 0.0, speed));
        for k in 1..20_000 {
            let before = block.state();
            let slope = 500.0 * speed;
            let mut hear = |at: f64, from: Contact, _| {
                if from == Contact::Stuck {
                    breakaways += 1;
                    let force = 500.0 * (before.device_position - before.position) + 2.0 * speed + slope * at;
                    worst = worst.max((force - 4.0).abs());
                }
            };
            // Only breakaways from the start of a tick are seen with their force; others re-stuck
            // within it.
            if before.contact == Contact::Stuck {
                block.tick_with_events(T, speed * f64::from(k) * T, speed, &mut hear);
            } else {
                block.tick(T, speed * f64::from(k) * T, speed);
            }
        }
        assert!(worst < 1e-9, "breakaway off by {worst} N at DV = {threshold}");
        breakaways
    };
    let counts = [slips(0.0), slips(0.01), slips(0.025)];
    println!("{counts:?}");
    assert!(counts[0] < counts[1] && counts[1] < counts[2], "{counts:?}");
}

#[test]
fn static_limit_below_dynamic_holds_to_dynamic_limit() {
    let scene = scene(&[("Fs-", 3.0)]); // Fd = 3.5 N
    let mut block = renderer(&scene, Scheme::Exact, 0.0, 0.0);
    let mut broke_at = None;
    for k in 1..400 {
        let position = -1e-6 * f64::from(k);
        let rendered = block.tick(T, position, 0.0);
        if block.state().contact != Contact::Stuck {
            broke_at = Some(rendered.coupling_force);
            break;
        }
    }
    let force = broke_at.expect("it lets go");
    assert!((force + 3.5).abs() < 0.03, "{force}");
}

#[test]
fn changing_any_parameter_in_motion_leaves_the_force_as_it_was() {
    for (position, velocity) in [(-1e-4, 0.0), (-2e-4, 0.03)] {
        for change in [
            ("M", 1.5),
            ("K", 40_000.0),
            ("B", 3.0),
            ("Fs", 8.0),
            ("Fd", 1.0),
            ("b", 5.0),
            ("DV", 0.01),
        ] {
            let mut old = renderer(&scene(&[]), Scheme::Exact, position, velocity);
            let before = old.tick(T, 1e-5, 0.01);
            let mut new = Renderer::new(&scene(&[change]), Scheme::Exact, T).expect("a valid scene");
            assert!(new.take_over(&old).abs() < 1e-9);
            // No time passes: the force is the new renderer's for the same sample.
            let after = new.tick(0.0, 1e-5, 0.01);
            assert!(
                (after.coupling_force - before.coupling_force).abs() < 1e-9,
                "{change:?}: {before:?} {after:?}"
            );
            if !matches!(change.0, "M" | "K" | "B") {
                assert_eq!(new.state().position, old.state().position, "{change:?} moved the block");
            }
        }
    }
}

#[test]
fn stiffer_coupling_causes_no_kick_in_motion() {
    for (from, to) in [(100.0, 25_000.0), (0.0, 25_000.0), (100.0, 3e6)] {
        let mut old = renderer(&scene(&[("K", from), ("B", 5.0)]), Scheme::Exact, -0.02, 0.1);
        let (mut device, speed) = (0.0, 0.2);
        old.tick(T, device, speed);
        let mut new = Renderer::new(&scene(&[("K", to), ("B", 5.0)]), Scheme::Exact, T).expect("a valid scene");
        new.take_over(&old);
        let mut most: f64 = 0.0;
        for _ in 0..50 {
            device += speed * T;
            most = most.max(new.tick(T, device, speed).coupling_force.abs());
        }
        // The friction's own step, from 2 N to 3.5 N and the swing beyond it, and no more.
        assert!(most < 6.5, "{from} to {to} N/m: {most} N");
    }
}

fn parameter(parameter: Parameter, scale: impl Strategy<Value = f64>) -> impl Strategy<Value = (ParameterKey, f64)> {
    scale.prop_map(move |value| (parameter.into(), value))
}

prop_compose! {
    /// Any scene in the accepted ranges, with each parameter spread over its decades and often
    /// exactly zero.
    fn any_scene()(
        mass in parameter(Parameter::Mass, (-6.0..2.0).prop_map(|e: f64| 10_f64.powf(e))),
        stiffness in parameter(Parameter::Stiffness, prop_oneof![1 => Just(0.0), 6 => (-1.0..6.47).prop_map(|e: f64| 10_f64.powf(e))]),
        damping in parameter(Parameter::Damping, prop_oneof![1 => Just(0.0), 4 => (-3.0..4.0).prop_map(|e: f64| 10_f64.powf(e))]),
        fs_plus in prop_oneof![1 => Just(0.0), 4 => (-3.0..3.0).prop_map(|e: f64| 10_f64.powf(e))],
        fs_minus in prop_oneof![1 => Just(0.0), 4 => (-3.0..3.0).prop_map(|e: f64| 10_f64.powf(e))],
        share_plus in prop_oneof![Just(1.0), Just(0.0), 0.0..1.0],
        share_minus in prop_oneof![Just(1.0), Just(0.0), 0.0..1.3],
        viscous in prop_oneof![Just(0.0), (-3.0..4.0).prop_map(|e: f64| 10_f64.powf(e))],
        threshold in prop_oneof![3 => Just(0.0), 1 => 0.0..1.0],
    ) -> Option<Scene> {
        let forces = [
            ("Fs+", fs_plus), ("Fs-", fs_minus), ("Fd+", fs_plus * share_plus), ("Fd-", (fs_minus * share_minus).min(1e3)),
            ("b", viscous), ("DV", threshold),
        ].map(|(name, value)| (name.parse().expect("a parameter"), value));
        let changes: Vec<_> = [mass, stiffness, damping].into_iter().chain(forces).collect();
        Scene::paper().with(&changes).ok().filter(|scene| scene.validate_rate(T).is_ok())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(60, 400), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_exact_scheme_never_blows_up(
        scene in any_scene(),
        steps in prop::collection::vec((0.0..1.0f64, -1.0..1.0f64, 0..100u8), 50..300),
        origin in prop_oneof![Just(0.0), -10.0..10.0f64],
    ) {
        let Some(scene) = scene else { return Ok(()); };
        let mut block = Renderer::new(&scene, Scheme::Exact, T).expect("a valid scene");
        block.start_at(origin, 0.0);
        let (mut position, mut velocity) = (origin, 0.0);
        let (k, m) = (scene.coupling.expect("a coupling").stiffness, scene.block.expect("a block").mass);
        for (jitter, push, event) in steps {
            // Jitter of +-30 %, now and then missed ticks or a jump of the encoder.
            let elapsed = T * (0.7 + 0.6 * jitter) * if event == 0 { 40.0 } else { 1.0 };
            velocity = 0.9 * velocity + 0.1 * push;
            position += velocity * elapsed + if event == 1 { 0.05 * push } else { 0.0 };
            let rendered = block.tick(elapsed, position, velocity);
            let after = block.state();
            prop_assert!(rendered.coupling_force.is_finite() && after.position.is_finite() && after.velocity.is_finite());
            prop_assert!(rendered.events <= 271);
            if let Contact::Sliding(direction) = after.contact {
                prop_assert!(direction.sign() * after.velocity >= 0.0, "a slide goes the way it says: {after:?}");
            } else {
                prop_assert_eq!(after.velocity, 0.0);
            }
        }
        // With the device at rest the block must come to rest, or keep to a bounded oscillation
        // without friction.
        let mut last_energy = f64::INFINITY;
        block.tick(T, position, 0.0);
        for _ in 0..200 {
            block.tick(T, position, 0.0);
            let s = block.state();
            let energy = 0.5 * m * s.velocity * s.velocity + 0.5 * k * (position - s.position) * (position - s.position);
            prop_assert!(energy <= last_energy * (1.0 + 1e-9) + 1e-9, "energy grew from {last_energy} to {energy}: \
                                                                       {scene:?}");
            last_energy = energy;
        }
    }
}

#[test]
fn a_slide_without_friction_turns_round_instead_of_sticking() {
    let scene = scene(&[("Fs", 0.0), ("Fd", 0.0), ("b", 35.0)]);
    let mut block = Renderer::new(&scene, Scheme::Exact, T).expect("a valid scene");
    block.start_at(0.0, 0.0);
    let mut contacts = std::collections::BTreeSet::new();
    for k in 1..1000 {
        let phase = 0.02 * f64::from(k);
        block.tick(T, 0.01 * phase.sin(), 0.2 * phase.cos());
        contacts.insert(block.state().contact.as_number());
    }
    assert!(!contacts.contains(&0), "{contacts:?}");
    assert_eq!(Direction::of(-1.0).sign(), -1.0);
}
