use super::*;
use crate::Directional;
use crate::rig_friction::{COGGING_HARMONICS, Cogging, Harmonic};
use proptest::prelude::*;
use std::vec::Vec;

extern crate std;

const T: f64 = 1e-3;
const RESOLUTION: f64 = 1e-5;

const RIG: RigFriction = RigFriction {
    mass: 1.4,
    dynamic_force: Directional::new(0.8, 0.6),
    viscous: Directional::new(1.0, 2.0),
    cogging: None,
    uncertainty: None,
};

fn compensator(share: f64) -> Compensator {
    Compensator::new(Compensation { share, friction: RIG })
}

fn motion(position: f64, velocity: f64) -> SampledMotion {
    SampledMotion {
        elapsed_s: T,
        position,
        velocity,
        resolution: RESOLUTION,
        period_s: T,
    }
}

/// The force after a hand has gone at a velocity for a while, on a surface that resists.
fn in_motion(mut compensator: Compensator, velocity: f64) -> f64 {
    let resistance = -copysign(3.0, velocity);
    let steps = 100;
    (0..steps)
        .map(|step| {
            let force = compensator.force(motion(f64::from(step) * velocity * T, velocity));
            compensator.applied(resistance + force);
            force
        })
        .last()
        .expect("a hundred steps")
}

fn near(value: f64, wanted: f64) -> bool {
    (value - wanted).abs() < 1e-12
}

#[test]
fn compensation_is_share_of_friction_in_motion_direction() {
    assert!(near(in_motion(compensator(0.5), 0.1), 0.5 * (0.8 + 0.1)));
    assert!(near(in_motion(compensator(0.5), -0.1), -0.5 * (0.6 + 0.2)));
    assert!(
        near(in_motion(compensator(7.0), 0.1), 0.8 * (0.8 + 0.1)),
        "at most the largest share"
    );
    assert_eq!(in_motion(compensator(0.0), 0.1), 0.0);
    assert_eq!(
        in_motion(compensator(0.8), 0.5e-3),
        0.0,
        "slower than dynamic friction begins"
    );
    let partly = in_motion(compensator(0.8), 5e-3);
    // A third of the interval from 2.5 mm/s to 10 mm/s, a quarter of a count and one in a sample.
    assert!(near(partly, 0.8 * (0.8 + 0.005) / 3.0), "{partly} N");
}

// hazard: F21
#[test]
fn after_a_rest_the_account_is_empty() {
    let mut compensator = compensator(0.8);
    let step = |compensator: &mut Compensator, step: i32| {
        let force = compensator.force(motion(f64::from(step) * 0.1 * T, 0.1));
        compensator.applied(force - 3.0);
        force
    };
    let before = (0..100).map(|k| step(&mut compensator, k)).last();
    assert!(before.is_some_and(|force| force > 0.5), "{before:?}");
    compensator.rest();
    assert_eq!(step(&mut compensator, 100), 0.0);
    assert!(step(&mut compensator, 101) < 0.5, "it fills again");
}

// hazard: F21
#[test]
fn slow_device_gets_no_more_energy_than_account_holds() {
    let mut compensator = compensator(0.8);
    // The force of a sample stays for 5 mm.
    let (speed, ticks) = (0.5, 10);
    let reserve_j = RESERVE_M * (0.8 + RESERVE_SPEED_MPS * 2.0);
    for step in 0..200 {
        let sample = step / ticks;
        let force = compensator.force(SampledMotion {
            elapsed_s: if step % ticks == 0 { f64::from(ticks) * T } else { 0.0 },
            ..motion(f64::from(sample * ticks) * speed * T, speed)
        });
        compensator.applied(force - 3.0);
        let coming_j = force * speed * f64::from(ticks) * T;
        assert!(
            coming_j <= reserve_j * 1.000_001,
            "{coming_j} J of {reserve_j} J in tick {step}"
        );
        assert!(sample < 2 || coming_j > 0.5 * reserve_j, "{coming_j} J in tick {step}");
    }
}

#[test]
fn cogging_is_compensated_only_where_the_place_is_known() {
    let mut harmonics = [Harmonic::default(); COGGING_HARMONICS];
    harmonics[0].cosine = 0.2;
    let with = |absolute_position| {
        let cogging = Some(Cogging {
            period_m: 0.01,
            absolute_position,
            harmonics,
        });
        let friction = RigFriction { cogging, ..RIG };
        in_motion(Compensator::new(Compensation { share: 0.5, friction }), 0.1)
    };
    let cogging_n = 0.2 * libm::cos(core::f64::consts::TAU * 0.0099 / 0.01);
    assert!(near(with(true), 0.5 * (0.9 + cogging_n)));
    assert!(near(with(false), 0.5 * 0.9));
}

#[test]
fn losses_left_by_compensation_are_a_lower_bound() {
    let left = Compensation {
        share: 0.5,
        friction: RIG,
    }
    .left_of(RIG.losses());
    assert!(near(left.friction, 0.6 - 0.4) && left.damping == 0.0, "{left:?}");
}

// hazard: F21
#[test]
fn without_a_surface_it_gives_no_more_than_the_assured_share() {
    let mut compensator = compensator(0.8);
    let mut given_j = 0.0;
    let mut force = 0.0;
    let distance = 0.1 * T;
    for step in 0..5000 {
        given_j += force * if step == 0 { 0.0 } else { distance };
        force = compensator.force(motion(f64::from(step) * distance, 0.1));
        compensator.applied(force);
    }
    let assured_j = ASSURED_SHARE * (0.6 + 1.0 * 0.1) * distance * 5000.0;
    assert!(given_j <= assured_j, "{given_j} J of {assured_j} J");
    assert!(given_j > 0.9 * assured_j, "{given_j} J of {assured_j} J");
}

/// What a device may say from one sample to the next: the motion, m, the velocity, m/s, the surface's force, N, and the
/// time, s.
fn any_step() -> impl Strategy<Value = (f64, f64, f64, f64)> {
    let moved = prop_oneof![
        4 => -1e-3..1e-3f64,
        4 => Just(0.0),
        4 => prop::sample::select(std::vec![1e-5, -1e-5]),
        1 => -0.05..0.05f64,
    ];
    let velocity = prop_oneof![4 => -1.0..1.0f64, 1 => Just(0.0), 1 => -100.0..100.0f64];
    let elapsed_s = prop_oneof![8 => Just(T), 1 => Just(0.0), 1 => 0.0..0.05f64];
    (moved, velocity, -20.0..20.0f64, elapsed_s)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Noise, jumps, steps at rest, swings, a velocity that has nothing to do with the motion, and
    /// any force of the surface.
    // hazard: F21
    #[test]
    fn compensation_energy_is_bounded_over_any_motion(
        steps in prop::collection::vec(any_step(), 1..300), swing in any::<bool>(), share in 0.0..1.0f64,
    ) {
        let mut compensator = compensator(share);
        let (mut position, mut motor_n) = (0.0, 0.0);
        // Since the last rest: what the motor gave beyond the assured friction, and the least of it.
        let (mut beyond_j, mut least_j) = (0.0_f64, 0.0_f64);
        let mut moved = 0.0;
        for (count, &(moves, velocity, surface_n, elapsed_s)) in steps.iter().enumerate() {
            let velocity = if swing { copysign(0.2, libm::sin(count as f64)) } else { velocity };
            let force = compensator.force(SampledMotion { elapsed_s, ..motion(position, velocity) });
            let most_n = MAX_SHARE.min(share) * (0.8 + 2.0 * velocity.abs()) + 1e-12;
            prop_assert!(force * velocity >= 0.0 && force.abs() <= most_n, "{} N at {} m/s", force, velocity);
            if compensator.still_s > REST_S {
                (beyond_j, least_j) = (0.0, 0.0);
            } else {
                let distance = f64::abs(moved);
                let speed = if elapsed_s > 0.0 { distance / elapsed_s } else { 0.0 };
                let assured_n = ASSURED_SHARE * (0.6 + 1.0 * speed);
                beyond_j += motor_n * moved - assured_n * distance;
                least_j = least_j.min(beyond_j);
            }
            if force != 0.0 {
                prop_assert!(beyond_j - least_j <= compensator.reserve_j + 1e-9, "{} J", beyond_j - least_j);
            }
            motor_n = surface_n + force;
            compensator.applied(motor_n);
            moved = moves;
            position += moved;
        }
    }

    /// However the encoder trembles within two counts, whatever the velocity and the surface are.
    // hazard: F21
    #[test]
    fn at_rest_it_adds_nothing(
        counts in prop::collection::vec((-2..=2i32, -10.0..10.0f64, -20.0..20.0f64), 150..300),
        strokes in 0..50u32,
    ) {
        let mut compensator = compensator(0.8);
        for step in 0..strokes {
            compensator.force(motion(f64::from(step) * 1e-4, 0.1));
            compensator.applied(-5.0);
        }
        let rest = f64::from(strokes) * 1e-4;
        let mut forces = Vec::new();
        let extremes = [(2, 0.0, 0.0), (-2, 0.0, 0.0)];
        for (count, velocity, surface_n) in extremes.into_iter().chain(counts) {
            // Half of the slack to either side.
            let force = compensator.force(motion(rest + f64::from(count) * 0.5 * RESOLUTION, velocity));
            compensator.applied(surface_n + force);
            forces.push(force);
        }
        prop_assert!(forces[103..].iter().all(|force| *force == 0.0), "{:?}", forces);
    }

    // hazard: F21
    #[test]
    fn what_is_no_number_gives_no_force_that_the_limiter_would_pass(
        position in prop::num::f64::ANY, velocity in prop::num::f64::ANY, motor_n in prop::num::f64::ANY,
    ) {
        let mut compensator = compensator(0.8);
        for step in 0..20 {
            compensator.force(motion(f64::from(step) * 1e-4, 0.1));
            compensator.applied(-5.0);
        }
        compensator.force(motion(position, velocity));
        compensator.applied(motor_n);
        let force = compensator.force(motion(position, 0.1));
        prop_assert!(!force.is_finite() || force.abs() <= 0.8 * 0.9 + 1e-12, "{} N", force);
    }
}
