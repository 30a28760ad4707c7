//! Known behaviour of the exact scheme: it comes to rest, holds, lets go and changes as the law says.

use crate::explore::{T, changed};
use haptic_core::block::{BlockState, Contact};
use haptic_core::{Renderer, Scene, Scheme};

/// The paper's scene with changes.
fn scene(changes: &[(&str, f64)]) -> Scene {
    changed(&Scene::paper(), changes)
}

fn renderer(scene: &Scene, scheme: Scheme, position: f64, velocity: f64) -> Renderer {
    let mut renderer = Renderer::new(scene, scheme, T).expect("a valid scene");
    renderer.set_state(BlockState::new(position, velocity, 0.0, 0.0));
    renderer
}

#[test]
fn the_exact_scheme_comes_to_rest_and_stays_there() {
    // The literal scheme trembles, and below 11.25 g diverges: see the tests of the adviser.
    for (mass, speed) in [(0.5, 0.5), (11.24e-3, 0.1), (1e-6, 0.1)] {
        let scene = scene(&[("mass", mass), ("Fs", 4.0), ("Fd", 4.0)]);
        let mut block = renderer(&scene, Scheme::Exact, 0.0, speed);
        for _ in 0..1000 {
            block.tick(T, 0.0, 0.0);
            assert!(block.state().position.abs() < 1e-2, "{mass} kg");
        }
        let resting = block.state();
        assert_eq!((resting.contact, resting.velocity), (Contact::Stuck, 0.0));
        for _ in 0..60_000 {
            block.tick(T, 0.0, 0.0);
        }
        assert_eq!(block.state().position, resting.position, "a stuck block does not creep");
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
}
