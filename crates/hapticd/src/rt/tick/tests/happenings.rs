//! Whatever happens, in whatever order: the force keeps its limits.

use super::*;
use crate::rt::space::FIRST_AXIS;
use device_io::protocol::message::ErrorCode;
use haptic_core::compensation::{Compensation, MAX_SHARE};
use haptic_core::rig_friction::RigFriction;
use haptic_core::velocity::METHODS;
use haptic_core::{Course, Directional, Excitation, OwnMotion, PulseShape};
use proptest::prelude::*;

/// Something that can happen to the loop between two ticks, or in one.
#[derive(Clone, Debug)]
enum Happening {
    Command(Command),
    Stop,
    Scene(usize),
    /// Over a time, s: in steps or, where the law is another, fading over.
    SlowScene(usize, f64),
    /// A pulse, an excitation, or rest in the place of the scene.
    HandMotion(usize),
    /// Leases lapse, or are taken again.
    Lease {
        lapses: bool,
    },
    /// The control thread falls silent, or beats again.
    Control {
        is_silent: bool,
    },
    /// A reading, or none; and time that goes by, ns.
    Tick(Option<f64>, u64),
    Repeat,
    Error(DeviceError),
    /// The device's clock goes on by a time other than ours, ns; negative, it jumps back.
    DeviceClock(i64),
    Missed(u64),
    RefusedWrite,
    BusyLink,
}

impl Happening {
    /// Whether it takes the force away, or may.
    fn is_trouble(&self) -> bool {
        !matches!(
            self,
            Self::Command(Command::Engage | Command::Reset)
                | Self::Scene(_)
                | Self::SlowScene(..)
                | Self::HandMotion(_)
                | Self::Lease { .. }
                | Self::Control { .. }
        )
    }
}

fn happening() -> impl Strategy<Value = Happening> {
    let position = prop_oneof![
        20 => (-0.1..0.1f64).prop_map(Some),
        1 => Just(None),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e9), Just(f64::MIN_POSITIVE)].prop_map(Some),
    ];
    let tick = (
        position,
        prop_oneof![8 => Just(1_000_000_u64), 1 => 0..2_000_000_u64, 1 => 0..100_000_000_u64],
    );
    prop_oneof![
        2 => Just(Happening::Command(Command::Engage)),
        1 => Just(Happening::Command(Command::Release)),
        2 => Just(Happening::Command(Command::Reset)),
        1 => Just(Happening::Stop),
        2 => (0..8_usize).prop_map(Happening::Scene),
        2 => (0..8_usize, 0.002..0.05f64).prop_map(|(which, over_s)| Happening::SlowScene(which, over_s)),
        2 => (0..3_usize).prop_map(Happening::HandMotion),
        1 => any::<bool>().prop_map(|lapses| Happening::Lease { lapses }),
        1 => any::<bool>().prop_map(|is_silent| Happening::Control { is_silent }),
        30 => tick.prop_map(|(position, after_ns)| Happening::Tick(position, after_ns)),
        1 => Just(Happening::Repeat),
        1 => prop_oneof![
            Just(DeviceError::MotorOff { watchdog: true }),
            Just(DeviceError::MotorOff { watchdog: false }),
            Just(DeviceError::Failed(ErrorCode::Sensor.into())),
        ]
        .prop_map(Happening::Error),
        2 => prop_oneof![Just(0), -1_000_000_000..0_i64, 0..100_000_000_i64].prop_map(Happening::DeviceClock),
        1 => (1..4_u64).prop_map(Happening::Missed),
        1 => Just(Happening::RefusedWrite),
        1 => Just(Happening::BusyLink),
    ]
}

/// As wide as they may be: more than the limits let through.
fn motions() -> [OwnMotion; 3] {
    let pulse = PulseShape {
        force_n: 30.0,
        rise_s: 0.001,
        hold_s: 0.28,
        fall_s: 0.01,
        travel_limit_m: 0.02,
        speed_limit_mps: 0.3,
        wrong_way_limit_m: 0.02,
    };
    let excitation = Excitation {
        course: Course::Sweep {
            travel_m: 0.05,
            speed_mps: 0.2,
            rounds: 2,
        },
        force_limit_n: 30.0,
        slew_limit_n_per_s: 2000.0,
        stiffness_n_per_m: 20_000.0,
        damping_ns_per_m: 20.0,
        travel_limit_m: 0.25,
        speed_limit_mps: 0.5,
        lag_limit_m: 0.25,
        wrong_way_limit_m: 0.25,
    };
    let bounded = [OwnMotion::pulse(pulse, 1e-3), OwnMotion::excitation(excitation, 1e-3)];
    let [pulse, excitation] = bounded.map(|motion| motion.expect("it is bounded"));
    [OwnMotion::REST, pulse, excitation]
}

/// Of a rig of much friction.
fn compensation() -> Compensation {
    Compensation {
        share: MAX_SHARE,
        friction: RigFriction {
            mass: 1.0,
            dynamic_force: Directional::both(30.0),
            viscous: Directional::both(50.0),
            cogging: None,
            uncertainty: None,
        },
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(120, 1000), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is measured, commanded and changed, whether a scene is rendered or a motion, with
    /// the rig's friction compensated or not: the force is a number within the limits, and zero
    /// where none may flow.
    // hazard: P2, H2, H15, F3, F20, F21
    #[test]
    fn force_stays_within_its_limits_and_where_it_belongs(
        happenings in prop::collection::vec(happening(), 1..250),
        accelerations in prop::collection::vec(-150.0..150.0f64, 250),
        // A calm device and a gentle hand end no motion at once, and let force flow for long.
        is_calm in any::<bool>(),
        is_compensated in any::<bool>(),
        method in prop::sample::select(&METHODS[..]),
        ramp_s in 0.001..0.05f64,
    ) {
        let (scenes, motions) = (scenes(), motions());
        let slew_n_per_s = 1000.0;
        let settings = Settings {
            ramp_s,
            passivity_control_n: 3.0,
            velocity: method,
            compensation: is_compensated.then(compensation),
            ..slewed(slew_n_per_s)
        };
        let mut bench = bench_with(settings, []);
        let vigour = if is_calm { 0.05 } else { 1.0 };
        let (mut position, mut velocity, mut revision, mut last) = (0.0, 0.0_f64, 1, 0.0_f64);
        let mut newest = Scene::paper();
        let (mut is_lapsed, mut is_silent, mut letting_go_s) = (false, false, 0.0);
        for (happening, acceleration) in happenings.into_iter().zip(accelerations) {
            // A hand that shakes as hard as one can, at no more than 2 m/s.
            velocity = (velocity + 1e-3 * vigour * acceleration).clamp(-2.0, 2.0);
            let step = 1e-3 * velocity;
            let (mut reading, mut after_ns, mut stopped) = (Ok(position), 1_000_000, false);
            let device = &mut *bench.tick.device;
            device.repeats = false;
            device.writing = Ok(Written::Taken);
            device.sample_ns = 1_000_000;
            let happening = if is_calm && happening.is_trouble() {
                Happening::Tick(Some(0.0), 1_000_000)
            } else {
                happening
            };
            match happening {
                Happening::Command(command) => {
                    if command == Command::Engage {
                        letting_go_s = 0.0;
                    }
                    bench.serial += 1;
                    bench.inbox.command(bench.serial, command, bench.shared.stops());
                }
                Happening::Stop => {
                    bench.shared.stop();
                    stopped = true;
                }
                Happening::Scene(which) => {
                    revision += 1;
                    newest = scenes[which].clone();
                    bench.inbox.post(compiled(&newest, revision));
                }
                Happening::SlowScene(which, over_s) => {
                    revision += 1;
                    let from = std::mem::replace(&mut newest, scenes[which].clone());
                    let ramp = CompiledScene::<f64>::ramped(&from, &newest, revision, Scheme::Exact, 1e-3, over_s);
                    bench.inbox.post(ramp.expect("both are valid"));
                }
                Happening::HandMotion(which) => {
                    bench.inbox.post_motion(motions[which], FIRST_AXIS);
                }
                Happening::Lease { lapses } => {
                    is_lapsed = lapses;
                    bench.shared.lease_until(if lapses { 0 } else { u64::MAX });
                }
                Happening::Control { is_silent: silent } => {
                    is_silent = silent;
                    bench.shared.heartbeat(if silent { 0 } else { u64::MAX });
                }
                // Mostly a hand that goes on, and now and then a leap to anywhere.
                Happening::Tick(Some(anywhere), ns) if !anywhere.is_finite() || anywhere.abs() > 0.09 => {
                    (reading, after_ns) = (Ok(anywhere), ns);
                }
                Happening::Tick(None, ns) => (reading, after_ns) = (Err(DeviceError::Disconnected), ns),
                Happening::Tick(Some(_), ns) => {
                    position += step;
                    (reading, after_ns) = (Ok(position), ns);
                }
                Happening::Repeat => device.repeats = device.next > 0,
                Happening::Error(error) => reading = Err(error),
                Happening::DeviceClock(ns) => {
                    position += step;
                    reading = Ok(position);
                    device.sample_ns = 0;
                    device.time_ns = device.time_ns.saturating_add_signed(ns);
                }
                Happening::Missed(periods) => bench.missed_periods += periods,
                Happening::RefusedWrite => device.writing = Err(DeviceError::Disconnected),
                Happening::BusyLink => device.writing = Ok(Written::Later),
            }
            let unreadable = !reading.is_ok_and(f64::is_finite);
            if !bench.tick.device.repeats {
                bench.tick.device.readings.push(reading);
            }
            let wrote_before = bench.tick.device.written.len();
            let record = bench.tick_after(after_ns);
            let force = record.command_force;
            prop_assert!(force.is_finite() && force.abs() <= MAX_FORCE, "{record:?}");
            prop_assert!(!stopped || force == 0.0, "a stop takes it away at once: {record:?}");
            prop_assert!(!unreadable || force == 0.0, "nothing is known of the hand: {record:?}");
            letting_go_s = if is_lapsed || is_silent {
                letting_go_s + (after_ns as f64 * 1e-9).min(MAX_STEP_S)
            } else {
                0.0
            };
            let is_let_go = letting_go_s > ramp_s + MAX_STEP_S;
            prop_assert!(!is_let_go || force == 0.0, "nobody is there: {record:?}");
            let most = slew_n_per_s * (after_ns as f64 * 1e-9).min(MAX_STEP_S) + 1e-9;
            prop_assert!(force.abs() - last.abs() <= most, "from {last} N to {force} N in {after_ns} ns");
            let written = &bench.tick.device.written;
            if written.len() > wrote_before {
                prop_assert_eq!(*written.last().expect("a force"), force);
                let live = record.state.is_live() || force == 0.0;
                prop_assert!(live, "force without a live rig: {:?}", record);
            }
            last = force;
        }
    }
}
