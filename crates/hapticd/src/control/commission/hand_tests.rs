//! Whole commissionings of a simulated rig, as `haptic-ctl commission` does them: a hand that moves the handle never
//! makes a reversed motor look right, and every rig that rests is found right.

use super::operations::MIN_CONFIRMED;
use super::pulse;
use crate::rt::outbox::tests::record;
use crate::telemetry::motion::HandleMotion;
use crate::telemetry::rest::Wait;
use device_io::fake::{Hand, HandMotion, Plant, RigProperties};
use haptic_core::OwnMotion;
use haptic_core::planar::Plane;
use haptic_ipc::{PulseEnd, SampleY};
use std::time::Duration;
use test_run::extent;

const PERIOD_S: f64 = 1e-3;

/// Duration of a pulse, and of the release and the engagement between two, ms.
const PULSE_MS: f64 = 200.0;
const BETWEEN_MS: u64 = 60;

/// A number that looks random, from 0 to 1.
fn chance(seed: u64) -> f64 {
    let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed ^ (mixed >> 32)) as f64 / u64::MAX as f64
}

struct TestRig {
    plant: Plant,
    /// How the motor is wired.
    sign: f64,
    /// The direction of its line in the plane; of a rig of one axis none.
    along: Option<Plane>,
    motion: HandleMotion,
    resolution_m: f64,
    /// Time before the first tick, s, and ticks since.
    phase_s: f64,
    ticks: u64,
    force_n: f64,
    pulses: u64,
}

impl TestRig {
    fn new(properties: &RigProperties, hand: Hand, sign: f64, phase_s: f64, along: Option<Plane>) -> Self {
        let mut plant = Plant::new(properties, hand);
        // The hand has moved it for a while.
        for ms in 0..500 {
            plant.advance(PERIOD_S, phase_s + f64::from(ms - 500) * PERIOD_S, 0.0);
        }
        Self {
            plant,
            sign,
            along,
            motion: HandleMotion::new(properties.resolution_m),
            resolution_m: properties.resolution_m,
            phase_s,
            ticks: 0,
            force_n: 0.0,
            pulses: 0,
        }
    }

    fn tick(&mut self, own: Option<&mut OwnMotion>) {
        let now_s = self.phase_s + self.ticks as f64 * PERIOD_S;
        self.plant.advance(PERIOD_S, now_s, self.sign * self.force_n);
        let position_m = (self.plant.position_m() / self.resolution_m).round() * self.resolution_m;
        let velocity_mps = self.plant.velocity_mps();
        let mut seen = record(self.ticks);
        self.force_n = 0.0;
        if let Some(own) = own {
            self.force_n = -own.tick(PERIOD_S, position_m, velocity_mps);
            seen.motion_end = own.end();
        }
        let along = self.along.unwrap_or_else(|| Plane::new(1.0, 0.0));
        seen.device_position = along.x * position_m;
        seen.device_velocity = along.x * velocity_mps;
        seen.command_force = along.x * self.force_n;
        let y = self.along.map(|along| SampleY {
            device_position_m: along.y * position_m,
            device_velocity_mps: along.y * velocity_mps,
            command_force_n: along.y * self.force_n,
            ..SampleY::default()
        });
        self.motion.take(&seen, y);
        self.ticks += 1;
    }

    /// One pulse; whether it has shown the direction.
    fn pulse(&mut self, force_n: f64) -> Result<bool, String> {
        for _ in 0..BETWEEN_MS {
            self.tick(None);
        }
        let shape = pulse::shape(force_n, PULSE_MS, self.resolution_m);
        let mut wait = Wait::new(shape.duration_s(), chance(self.pulses + self.phase_s.to_bits()));
        self.pulses += 1;
        while !self.motion.rests_for(&mut wait)? {
            self.tick(None);
        }
        self.motion
            .begin_pulse(shape, self.along.unwrap_or_else(|| Plane::new(1.0, 0.0)));
        let mut own = OwnMotion::pulse(shape, PERIOD_S).expect("it is bounded");
        own.place(
            (self.plant.position_m() / self.resolution_m).round() * self.resolution_m,
            0.0,
        );
        while !self.motion.pulse_is_over() {
            self.tick(Some(&mut own));
        }
        let (report, is_confirmed) = self.motion.end_pulse(false, Duration::ZERO).expect("it was watched");
        match report.end {
            PulseEnd::WrongWay => Err("it moved against the force".to_owned()),
            _ => Ok(is_confirmed),
        }
    }

    /// Whether a commissioning with pulses of at most so much force, N, finds its direction right.
    fn commissioned(&mut self, largest_n: f64) -> Result<(), String> {
        let mut confirmed = [0; 2];
        let mut sure_n = [0.0; 2];
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let mut force_n = 0.1 * largest_n;
            while !self.pulse(sign * force_n)? {
                if force_n >= largest_n {
                    return Err(format!("nothing moved under {force_n} N"));
                }
                force_n = (1.25 * force_n).min(largest_n);
            }
            confirmed[side] += 1;
            sure_n[side] = (1.5 * force_n).min(largest_n);
        }
        // As many as the search for the ends of a range gives.
        for _ in 0..20 {
            for (side, sign) in [(0, 1.0), (1, -1.0), (1, -1.0), (0, 1.0)] {
                confirmed[side] += u32::from(self.pulse(sign * sure_n[side])?);
            }
            if confirmed.iter().all(|times| *times >= MIN_CONFIRMED) {
                return Ok(());
            }
        }
        Err(format!("{confirmed:?} pulses have shown it"))
    }
}

/// A direction in the plane for every other case.
fn some_line(seed: u64) -> Option<Plane> {
    let (sine, cosine) = (6.0 * chance(seed)).sin_cos();
    (seed % 2 == 1).then(|| Plane::new(cosine, sine))
}

// hazard: H13
#[test]
fn moving_hand_never_makes_a_reversed_motor_look_right() {
    let cases = extent(400, 4000);
    let mut refused: Vec<String> = Vec::new();
    for seed in 0..cases {
        let of = |number: u64| chance(seed * 16 + number);
        let frequency_hz = 0.1 * 30.0_f64.powf(of(0));
        let motion = HandMotion::Sine {
            amplitude_m: 1e-4 * 300.0_f64.powf(of(1)),
            frequency_hz,
        };
        let hand = match seed % 3 {
            0 => Hand::Prescribed(motion),
            kind => Hand::Arm {
                stiffness_n_per_m: if kind == 1 { 500.0 } else { 100.0 * 20.0_f64.powf(of(2)) },
                damping_ns_per_m: 5.0,
                motion,
            },
        };
        let properties = RigProperties {
            mass_kg: 0.05 * 60.0_f64.powf(of(3)),
            friction_n: 0.02 * 100.0_f64.powf(of(4)),
            resolution_m: 1e-6 * 100.0_f64.powf(of(5)),
            ..RigProperties::default()
        };
        let largest_n = [0.4, 2.0][(seed / 3 % 2) as usize];
        let setup = format!("{hand} on {properties:?}, {largest_n} N");
        let mut rig = TestRig::new(&properties, hand, -1.0, 1.0 + of(6) / frequency_hz, some_line(seed));
        match rig.commissioned(largest_n) {
            Ok(()) => panic!("case {seed}: {setup}: a reversed motor looks right"),
            Err(why) => refused.push(why),
        }
    }
    let by_itself = refused.iter().filter(|why| why.contains("moves by itself")).count() as u64;
    assert!(by_itself > cases / 3, "{by_itself} of {cases}: {refused:?}");
}

// hazard: H13
#[test]
fn resting_rig_of_any_usual_kind_is_found_right_or_reversed() {
    for seed in 0..extent(60, 600) {
        let of = |number: u64| chance(seed * 16 + number);
        let properties = RigProperties {
            mass_kg: 0.05 * 60.0_f64.powf(of(0)),
            friction_n: 0.03 * 50.0_f64.powf(of(1)),
            damping_ns_per_m: 2.0 * of(2),
            breakaway_ratio: 1.0 + 0.3 * of(3),
            resolution_m: 1e-6 * 100.0_f64.powf(of(4)),
            ..RigProperties::default()
        };
        for sign in [1.0, -1.0] {
            let mut rig = TestRig::new(&properties, Hand::Free, sign, 1.0, some_line(seed));
            let found = rig.commissioned(2.0);
            if sign > 0.0 {
                assert_eq!(found, Ok(()), "case {seed}: {properties:?} after {} pulses", rig.pulses);
            } else {
                let why = found.expect_err("it is reversed");
                assert!(why.contains("against the force"), "case {seed}: {properties:?}: {why}");
            }
        }
    }
}
