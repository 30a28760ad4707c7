//! Stick-slip as it is reckoned is that of the closed form, and that of a hand that pulls for long.

use super::scene;
use crate::adviser::{StickSlipError, static_force_for, stick_slip, stiffness_for};
use crate::contact::Contact;
use crate::{Renderer, Scene, Scheme};
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;

#[test]
fn without_damping_the_period_is_the_closed_form() {
    for (mass, stiffness, held, kinetic, speed) in [
        (0.5_f64, 25_000.0_f64, 4.0_f64, 3.5_f64, 5e-3_f64),
        (0.5, 25_000.0, 4.0, 3.5, 1e-5),
        (0.5, 25_000.0, 4.0, 3.5, 0.5),
        (2.0, 300.0, 9.0, 1.0, -0.02),
        (1e-3, 3e4, 3.0, 2.0, 0.1),
    ] {
        let scene = scene(&[("M", mass), ("K", stiffness), ("B", 0.0), ("Fs", held), ("Fd", kinetic)]);
        let found = stick_slip(&scene, speed).expect("reckoned").expect("stick-slip");
        let (omega, drop) = ((stiffness / mass).sqrt(), (held - kinetic) / stiffness);
        let theta = 2.0 * (core::f64::consts::PI - (drop * omega / speed.abs()).atan());
        let (slip, stick) = (theta / omega, 2.0 * drop / speed.abs());
        let off = |found: f64, wanted: f64| (found / wanted - 1.0).abs();
        assert!(
            off(1.0 / found.frequency_hz, slip + stick) < 1e-12,
            "{found:?} for {slip} and {stick}"
        );
        let rounding = 1e-12 * (slip + stick);
        assert!(
            (found.slip_s - slip).abs() < rounding && (found.stick_s - stick).abs() < rounding,
            "{found:?}"
        );
        assert!(off(found.jump_n, 2.0 * (held - kinetic)) < 1e-10, "{found:?}");
        // Whatever the block's motion, friction takes Fd in the slide, and the rest is a straight line about Fd.
        assert!(off(found.mean_force_n, kinetic) < 1e-6, "{found:?}");
    }
}

/// Breakaways a second of a hand that pulls at a velocity (m/s) for long, at 1 kHz, and the mean force (N).
fn pulled(scene: &Scene, velocity: f64) -> (f64, f64) {
    let tick_s = 1e-3;
    let mut renderer = Renderer::new(scene, Scheme::Exact, tick_s).expect("a valid scene");
    renderer.start_at(0.0, 0.0);
    renderer.tick(1e3, 0.0, 0.0);
    let (mut late, mut sum, mut count) = (Vec::new(), 0.0, 0.0);
    let ticks = 40_000;
    for tick in 1..=ticks {
        let from_s = f64::from(tick - 1) * tick_s;
        let mut hear = |at_s: f64, from: Contact, _: Contact| {
            if from == Contact::Stuck && from_s + at_s > 20.0 {
                late.push(from_s + at_s);
            }
        };
        let force = renderer
            .tick_with_events(tick_s, velocity * f64::from(tick) * tick_s, velocity, &mut hear)
            .coupling_force;
        if tick > ticks / 2 {
            (sum, count) = (sum + force, count + 1.0);
        }
    }
    let frequency = match late.as_slice() {
        [first, .., last] => (late.len() - 1) as f64 / (last - first),
        _ => 0.0,
    };
    (frequency, velocity.signum() * sum / count)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(60, 600), rng_seed: proptest::test_runner::RngSeed::Fixed(36), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_hand_that_pulls_for_long_feels_what_is_reckoned(
        mass in (-1.5..0.5f64).prop_map(|e| 10_f64.powf(e)), stiffness in (2.5..4.5f64).prop_map(|e| 10_f64.powf(e)),
        damping in prop_oneof![Just(0.0), 0.0..20.0f64], viscous in prop_oneof![Just(0.0), 0.0..10.0f64],
        kinetic in 0.5..4.0f64, more in 0.1..4.0f64, threshold in prop_oneof![Just(0.0), 0.0..0.02f64],
        curve in prop_oneof![Just(0.0), (-3.0..-1.0f64).prop_map(|e| 10_f64.powf(e))],
        rising in prop_oneof![Just(0.0), (0.0..2.0f64).prop_map(|e| 10_f64.powf(e))],
        velocity in ((-3.0..-1.0f64), any::<bool>()).prop_map(|(e, back)| if back { -1.0 } else { 1.0 } * 10_f64.powf(e)),
    ) {
        let scene = scene(&[
            ("M", mass), ("K", stiffness), ("B", damping), ("b", viscous), ("Fs", kinetic + more), ("Fd", kinetic),
            ("DV", threshold), ("ws", curve), ("gamma", rising),
        ]);
        let found = stick_slip(&scene, velocity).expect("reckoned");
        // The hand pulls for 20 s.
        prop_assume!(found.is_none_or(|found| found.frequency_hz > 0.3));
        // Without damping a slide that just does not end does by rounding.
        prop_assume!(found.is_some() || rising == 0.0 && damping + viscous > 0.5);
        // A limit that rises in rest settles from period to period; without damping it may never.
        prop_assume!(rising == 0.0 || damping + viscous > 1.0);
        let (frequency, mean) = pulled(&scene, velocity);
        match found {
            None => prop_assert!(frequency == 0.0, "{frequency} Hz"),
            Some(found) => {
                let exact = if rising > 0.0 { 5e-2 } else { 1e-7 };
                prop_assert!((found.frequency_hz / frequency - 1.0).abs() < exact, "{found:?} for {frequency} Hz");
                // The hand does not stop after whole periods.
                let part = found.jump_n / (20.0 * frequency);
                prop_assert!((found.mean_force_n - mean).abs() < 0.02 * mean + part, "{found:?} for {mean} N");
            }
        }
    }

    #[test]
    fn the_value_for_a_frequency_gives_it(
        damping in 0.0..20.0f64, speed in (-3.5..-1.5f64).prop_map(|e| 10_f64.powf(e)), threshold in prop_oneof![Just(0.0), Just(2e-3)],
        share in 0.3..3.0f64,
    ) {
        let scene = scene(&[("B", damping), ("DV", threshold)]);
        let Some(now) = stick_slip(&scene, speed).expect("reckoned") else { return Ok(()) };
        let wanted = share * now.frequency_hz;
        for (name, value) in [("K", stiffness_for(&scene, speed, wanted)), ("Fs", static_force_for(&scene, speed, wanted))] {
            let frequency = |value: f64| {
                let changed = scene.with(&[(name.parse().expect("a parameter"), value)]).expect("a valid scene");
                stick_slip(&changed, speed).expect("reckoned").map_or(0.0, |found| found.frequency_hz)
            };
            match value {
                Ok(value) => prop_assert!((frequency(value) / wanted - 1.0).abs() < 1e-6, "{name} = {value}"),
                Err(StickSlipError::OutOfReach { reach: Some((least, most)), .. }) => {
                    // A threshold makes the frequency jump: slides end in their first swing, or in a later one.
                    prop_assert!(
                        threshold > 0.0 || !(least..=most).contains(&wanted), "{name}: {wanted} Hz is from {least} to {most}");
                }
                Err(error) => prop_assert!(false, "{error}"),
            }
        }
    }
}

#[test]
fn above_the_critical_speed_the_block_slides_on() {
    let scene = scene(&[]);
    let found = |speed| stick_slip(&scene, speed).expect("reckoned");
    let (mut sticks, mut slides) = (1e-3, 1.0);
    assert!(found(sticks).is_some() && found(slides).is_none());
    for _ in 0..40 {
        let middle = 0.5 * (sticks + slides);
        if found(middle).is_some() {
            sticks = middle;
        } else {
            slides = middle;
        }
    }
    assert!(
        pulled(&scene, 0.99 * sticks).0 > 0.0 && pulled(&scene, 1.01 * slides).0 == 0.0,
        "{sticks}"
    );
}

#[test]
fn what_cannot_be_reckoned_is_refused_with_its_reason() {
    let lugre = Scene::paper().with_law("lugre").expect("a law").expect("a valid scene");
    assert_eq!(stick_slip(&lugre, 0.01), Err(StickSlipError::NotRigid));
    let error = stick_slip(&Scene::paper(), 0.0).expect_err("no speed").to_string();
    assert!(
        error.contains("speed = 0 m/s") && error.contains("from 0.000001 to 10 m/s"),
        "{error}"
    );
    let error = stiffness_for(&Scene::paper(), 5e-3, 5e4)
        .expect_err("too often")
        .to_string();
    assert!(
        error.contains("no stiffness gives 50000 Hz") && error.contains(" to "),
        "{error}"
    );
    assert_eq!(
        stick_slip(&scene(&[("Fs", 3.5), ("B", 0.0)]), 0.01),
        Ok(None),
        "nothing falls"
    );
}
