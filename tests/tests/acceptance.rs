//! Three scenes in which other haptic software fails, on the fake rig's plant with the daemon's own
//! estimator and renderer, in a 1 kHz loop without a clock: device of 0.1 kg, 5 um encoder, Fs = 2
//! N, Fd = 1.5 N.

use device_io::Device;
use device_io::fake::{FakeRig, Hand, HandMotion, Recording, RigProperties};
use haptic_core::block::Contact;
use haptic_core::velocity::{Estimator, Method};
use haptic_core::{Renderer, Scene, Scheme};
use std::sync::Arc;

const PERIOD_NS: u64 = 1_000_000;
const RESOLUTION_M: f64 = 5e-6;

fn scene() -> Scene {
    // A coupling that the light rig carries: K < 2 (b_rig + B)/T with its least damping of 0.1 N s/m.
    let changes = [("M", 0.02), ("K", 5000.0), ("B", 5.0), ("Fs", 2.0), ("Fd", 1.5)]
        .map(|(name, value)| (name.parse().expect("a parameter"), value));
    Scene::paper().with(&changes).expect("a valid scene")
}

struct Tick {
    force_on_hand: f64,
    block_position: f64,
    contact: Contact,
}

/// Runs the loop for some ticks.
fn run(damping_ns_per_m: f64, hand: Hand, ticks: u64) -> Vec<Tick> {
    let properties = RigProperties {
        mass_kg: 0.1,
        friction_n: 0.0,
        damping_ns_per_m,
        resolution_m: RESOLUTION_M,
        ..RigProperties::default()
    };
    let mut rig = FakeRig::new(properties, hand);
    let mut velocity = Estimator::new(Method::default(), 1e-3, RESOLUTION_M);
    let mut renderer = Renderer::new(&scene(), Scheme::Exact, 1e-3).expect("a valid scene");
    let first = rig.read(0).expect("it is there");
    velocity.update(0.0, first.position_m);
    renderer.start_at(first.position_m, 0.0);
    (1..ticks)
        .map(|k| {
            let sample = rig.read(k * PERIOD_NS).expect("it is there");
            let speed = velocity.update(1e-3, sample.position_m);
            let rendered = renderer.tick(1e-3, sample.position_m, speed);
            rig.write(-rendered.coupling_force, true).expect("it is there");
            Tick {
                force_on_hand: -rendered.coupling_force,
                block_position: renderer.state().position,
                contact: renderer.state().contact,
            }
        })
        .collect()
}

/// A hand that goes at a steady speed for some seconds.
fn steady(speed_mps: f64, seconds: f64) -> HandMotion {
    let samples = (0..=1000).map(|k| {
        let t = seconds * f64::from(k) / 1000.0;
        (t, speed_mps * t)
    });
    let recording = Recording::new("steady", samples).expect("a motion");
    HandMotion::Recorded(Arc::new(recording))
}

#[test]
fn a_slow_pull_through_a_soft_arm_gives_clean_stick_slip() {
    let hand = Hand::Arm {
        stiffness_n_per_m: 500.0,
        damping_ns_per_m: 0.0,
        motion: steady(0.005, 20.0),
    };
    let ticks = run(5.0, hand, 20_000);
    let slips = ticks
        .windows(2)
        .filter(|pair| pair[0].contact == Contact::Stuck && pair[1].contact != Contact::Stuck)
        .count();
    let drop = ticks
        .windows(2)
        .map(|pair| pair[1].force_on_hand - pair[0].force_on_hand)
        .fold(0.0, f64::max);
    let settled = &ticks[2000..];
    let (least, most) = settled.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), tick| {
        (least.min(-tick.force_on_hand), most.max(-tick.force_on_hand))
    });
    println!("{slips} slips, largest drop in a tick {drop:.3} N, force {least:.3} to {most:.3} N");
    assert!((10..200).contains(&slips), "{slips} slips in 20 s");
    assert!(drop <= 0.55, "{drop} N in one tick");
    assert!((most - 2.0).abs() < 0.1, "{most} N at breakaway");
    assert!(least > 0.8, "{least} N at the least");
}

#[test]
fn a_block_stuck_under_an_alternating_load_stays_where_it_is() {
    for damping in [5.0, 0.1] {
        let hand = Hand::Push {
            offset_n: 0.8,
            amplitude_n: 0.5,
            frequency_hz: 5.0,
        };
        let ticks = run(damping, hand, 60_000);
        // The load's sudden start is a blow; what counts is what comes after.
        let (begin, end) = (ticks[2000].block_position, ticks[59_998].block_position);
        let drift = (end - begin).abs();
        println!("damping {damping} N s/m: drift {drift:.1e} m in 58 s");
        assert!(drift <= 1e-6, "{drift} m");
    }
}

#[test]
fn a_fast_steady_slide_is_felt_as_a_steady_force() {
    // The second speed is no whole number of counts a tick, so that the encoder's noise is in it.
    for speed in [0.5, 0.4987] {
        let ticks = run(5.0, Hand::Prescribed(steady(speed, 4.0)), 3900);
        // The start is a jerk of the hand; the coupling has settled after a second.
        let settled = &ticks[1000..];
        let mean = settled.iter().map(|tick| -tick.force_on_hand).sum::<f64>() / settled.len() as f64;
        let change = settled
            .windows(2)
            .map(|pair| (pair[1].force_on_hand - pair[0].force_on_hand).abs())
            .fold(0.0, f64::max);
        println!("{speed} m/s: mean {mean:.4} N, largest change in a tick {change:.4} N");
        assert!((mean / 1.5 - 1.0).abs() < 0.01, "{mean} N at {speed} m/s");
        assert!(change <= 0.2, "{change} N at {speed} m/s");
    }
}
