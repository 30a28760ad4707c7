//! Hands against a sampled wall: inside a bound none gets energy out, outside one that is searched
//! for does. They go straight from sample to sample, to and fro at every frequency up to half the
//! rate, or at random.

use super::{RIG, exact, random, wall};
use crate::adviser::sampled::Sampled;
use crate::adviser::{Check, EXPLORING_SPEED_MPS, RigFacts};
use crate::{Renderer, Scene, Scheme};
use core::f64::consts::PI;
use proptest::prelude::*;

const T: f64 = 1e-3;

/// Energy, J, that the wall, the rig's damping and its friction take from a hand on a path (m) from
/// place to place, each a sample and so many periods of delay before its force; the least of all
/// moments.
fn taken(scene: &Scene, rig: &RigFacts, delay: usize, places: impl Iterator<Item = f64>) -> f64 {
    let counted = |place: f64| {
        if rig.resolution > 0.0 {
            (place / rig.resolution).round() * rig.resolution
        } else {
            place
        }
    };
    let mut wall = Renderer::new(scene, Scheme::Exact, T).expect("a valid scene");
    let mut places = places.peekable();
    let start = *places.peek().expect("a place");
    // It begins without force, but for what is counted off the place.
    wall.start_at(start, 0.0);
    let (mut forces, mut here, mut last) = (std::vec![0.0; delay], start, counted(start));
    let (mut taken, mut least) = (0.0, f64::INFINITY);
    for next in places {
        let sample = counted(here);
        forces.insert(0, wall.tick(T, sample, (sample - last) / T).coupling_force);
        last = sample;
        let step: f64 = next - here;
        taken += forces.pop().expect("one is kept") * step + rig.damping * step * step / T + rig.friction * step.abs();
        least = f64::min(least, taken);
        here = next;
    }
    least
}

/// A hand that goes to and fro by a sine, at so much of a turn a period.
fn sine(theta: f64) -> impl Iterator<Item = f64> {
    (0..4000).map(move |k| 1e-3 * ((theta * f64::from(k)).sin()))
}

/// A hand that goes to and fro at the exploring speed, so many periods each way.
fn to_and_fro(periods: i32) -> impl Iterator<Item = f64> {
    (0..i32::max(40 * periods, 4000)).map(move |k| {
        let phase = k % (2 * periods);
        EXPLORING_SPEED_MPS * T * f64::from(phase.min(2 * periods - phase))
    })
}

/// A hand that goes anywhere, by at most such a distance (m) a period.
fn anywhere(seed: u64, most: f64) -> impl Iterator<Item = f64> {
    random(seed).take(400).scan(0.0, move |place, share| {
        *place += share * most;
        Some(*place)
    })
}

fn frequencies() -> impl Iterator<Item = f64> {
    (1..=400).map(|k| PI * f64::from(k) / 400.0)
}

const NOTHING: RigFacts = RigFacts {
    friction: 0.0,
    resolution: 0.0,
    ..RIG
};

#[test]
fn without_delay_the_bound_is_that_of_colgate() {
    for (stiffness, damping) in [(25_000.0, 10.0), (1000.0, 0.0), (0.0, 5.0)] {
        let needed = Sampled::new(T, 0.0).damping_needed(stiffness, damping);
        assert!((needed - (stiffness * T / 2.0 + damping)).abs() < 1e-9, "{needed}");
    }
    // A force that comes between two samples.
    let times = Sampled::new(T, 0.4e-3);
    let needed = times.damping_needed(1000.0, 0.0);
    assert!((needed / (1000.0 * times.lateness_s()) - 1.0).abs() < 1e-6, "{needed}");
    assert!(needed > 1000.0 * 0.9e-3);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(12, 60), rng_seed: proptest::test_runner::RngSeed::Fixed(36), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_rig_that_damps_more_gives_no_hand_energy(
        stiffness in 100.0..3e4f64, damping in prop_oneof![Just(0.0), 0.0..30.0f64], delay in 0..4usize,
        seed in any::<u64>(),
    ) {
        let rig = RigFacts { delay_s: T * delay as f64, ..NOTHING };
        let scene = wall(stiffness, damping);
        let needed = exact(&scene, &rig, Check::Passivity).bound;
        let inside = RigFacts { damping: needed * (1.0 + 1e-6), ..rig };
        let hands = frequencies().map(|theta| taken(&scene, &inside, delay, sine(theta)));
        let least = hands.fold(taken(&scene, &inside, delay, anywhere(seed, 1e-3)), f64::min);
        prop_assert!(least > -1e-9, "{least} J");
        let outside = RigFacts { damping: 0.98 * needed, ..rig };
        let hands = frequencies().map(|theta| taken(&scene, &outside, delay, sine(theta)));
        let least = hands.fold(f64::INFINITY, f64::min);
        prop_assert!(least < -1e-6, "{least} J");
    }

    #[test]
    fn a_rig_that_rubs_more_gives_no_slow_hand_energy(
        friction in 0.2..5.0f64, own in 0.0..5.0f64, damping in prop_oneof![Just(0.0), 0.0..8.0f64], delay in 0..4usize,
        seed in any::<u64>(),
    ) {
        let rig = RigFacts { delay_s: T * delay as f64, friction, damping: own, ..NOTHING };
        let bound = exact(&wall(1.0, damping), &rig, Check::Friction).bound;
        prop_assume!(bound > 100.0);
        let inside = wall(0.99 * bound, damping);
        let hands = (1..200).map(|periods| taken(&inside, &rig, delay, to_and_fro(periods)));
        let random = taken(&inside, &rig, delay, anywhere(seed, EXPLORING_SPEED_MPS * T));
        let least = hands.fold(random, f64::min);
        prop_assert!(least > -1e-9, "{least} J");
        // With delay the damper takes up more than it gives out, where the spring gives out most.
        if delay == 0 || damping == 0.0 {
            let outside = wall(1.03 * bound, damping);
            let hands = (1..200).map(|periods| taken(&outside, &rig, delay, to_and_fro(periods)));
            let least = hands.fold(f64::INFINITY, f64::min);
            prop_assert!(least < -1e-7, "{least} J");
        }
    }

    #[test]
    fn a_rig_that_rubs_more_gives_no_energy_by_counting(
        friction in 0.2..5.0f64, damping in prop_oneof![Just(0.0), 0.0..5.0f64], count in 2e-6..5e-5f64,
        seed in any::<u64>(),
    ) {
        let rig = RigFacts { friction, resolution: count, ..RIG };
        let bound = exact(&wall(1.0, damping), &rig, Check::Encoder).bound;
        // A scene has 3 MN/m at most.
        prop_assume!(bound > 10.0 && bound < 2.9e6);
        let enough = |stiffness| RigFacts { damping: stiffness * T / 2.0 + damping, ..rig };
        // To and fro across the place where the count changes.
        let across = |k: i32| count * (0.5 + if k % 2 == 0 { 1e-3 } else { -1e-3 });
        let least = |stiffness: f64| {
            let (scene, rig) = (wall(stiffness, damping), enough(stiffness));
            let random = taken(&scene, &rig, 0, anywhere(seed, 2.0 * count));
            random.min(taken(&scene, &rig, 0, (0..20_000).map(across)))
        };
        let (inside, outside) = (least(0.99 * bound), least(1.03 * bound));
        prop_assert!(inside > -1e-12 && outside < -1e-12, "{inside} and {outside} J");
    }
}
