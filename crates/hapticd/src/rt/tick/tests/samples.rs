//! Samples that are wrong, repeated, impossible or absent.

use super::*;
use device_io::protocol::message::ErrorCode;
use haptic_core::servo::Fault;

// hazard: H6
#[test]
fn a_lone_wrong_sample_changes_no_force_and_is_counted() {
    let run = |wrong_m: f64| {
        let mut bench = bench((0..2000).map(|k| {
            let honest = 1e-4 * f64::from(k);
            Ok(if k == 400 { honest + wrong_m } else { honest })
        }));
        bench.ticks(SETTLE);
        bench.engage();
        let records: Vec<TickRecord> = (0..600).map(|_| bench.tick()).collect();
        assert_eq!(records[599].samples_forgotten, u64::from(wrong_m != 0.0));
        records
    };
    let honest = run(0.0);
    for wrong_m in [0.5e-3, 1e-3, -1e-3, 0.05, -3.0] {
        let wrong = run(wrong_m);
        assert!(wrong.iter().all(|record| record.fault.is_none()), "{wrong_m} m");
        for (honest, wrong) in honest.iter().zip(&wrong) {
            let difference = (wrong.command_force - honest.command_force).abs();
            assert!(difference < 0.3, "{wrong_m} m: {difference} N at tick {}", wrong.tick);
        }
    }
}

// hazard: H16
#[test]
fn force_decays_without_new_samples_and_returns_without_jump() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.ticks(300);
    let before = bench.tick().command_force.abs();
    bench.tick.device.repeats = true;
    let mut last = before;
    for silent in 1..=30 {
        let record = bench.tick();
        assert!(record.state.is_live(), "{record:?}");
        let force = record.command_force.abs();
        assert!(force <= last, "it only decays: {record:?}");
        match silent {
            1..=3 => assert_eq!(force, before, "three periods are no reason"),
            4..=22 => assert!(force < last, "{silent}: {record:?}"),
            _ => assert_eq!(force, 0.0, "{silent}"),
        }
        last = force;
    }
    bench.tick.device.repeats = false;
    // The hand has gone on meanwhile.
    bench.tick.device.next += 30;
    bench.tick.device.sample_ns = 31_000_000;
    for _ in 0..100 {
        let record = bench.tick();
        bench.tick.device.sample_ns = 1_000_000;
        assert!(record.command_force.abs() - last < 0.5, "no jump: {record:?}");
        last = record.command_force.abs();
    }
    assert!(last > 0.8 * before, "{last} N of {before} N");
}

#[test]
fn repeating_device_faults_and_recovers_after_a_reset() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(60);
    bench.tick.device.repeats = true;
    let before = bench.tick();
    assert!(
        before.command_force != 0.0,
        "a late sample is no reason yet: {before:?}"
    );
    bench.ticks(50);
    let lost = bench.tick();
    assert_eq!((lost.state, lost.command_force), (RigState::Faulted, 0.0));
    assert_eq!(lost.fault, Some(Fault::Stale));
    bench.command(Command::Reset);
    bench.ticks(2);
    assert_eq!(bench.tick().state, RigState::Disconnected, "there is still nothing new");
    bench.tick.device.repeats = false;
    bench.ticks(10);
    assert_eq!(bench.tick().state, RigState::Idle);
}

#[test]
fn motor_off_faults_and_a_lost_device_disconnects() {
    for (error, state, fault) in [
        (
            DeviceError::MotorOff { watchdog: true },
            RigState::Faulted,
            Some(Fault::MotorOff { watchdog: true }),
        ),
        (
            DeviceError::Failed(ErrorCode::Sensor.into()),
            RigState::Faulted,
            Some(Fault::Device(ErrorCode::Sensor.into())),
        ),
        (DeviceError::Disconnected, RigState::Disconnected, None),
    ] {
        let mut bench = bench(ramp().take(100).chain([Err(error)]).chain(ramp()));
        bench.tick();
        bench.command(Command::Engage);
        bench.ticks(98);
        let told = bench.tick();
        assert_eq!((told.state, told.fault, told.command_force), (state, fault, 0.0));
        assert_eq!(bench.last_written(), 0.0);
    }
}

#[test]
fn a_failed_read_is_zero_force_and_never_engages_by_itself() {
    let readings = ramp()
        .take(100)
        .chain(std::iter::repeat_n(Err(DeviceError::Disconnected), 5))
        .chain(ramp());
    let mut bench = bench(readings);
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(99 - SETTLE);
    assert!(bench.last_written() < -0.1);
    let lost = bench.tick();
    assert_eq!((lost.state, lost.command_force), (RigState::Disconnected, 0.0));
    bench.ticks(4);
    for _ in 0..50 {
        let back = bench.tick();
        assert_eq!((back.state, back.command_force), (RigState::Idle, 0.0));
    }
}

#[test]
fn a_position_that_is_no_number_faults_at_zero_force() {
    let mut bench = bench(ramp().take(100).chain([Ok(f64::NAN)]).chain(ramp()));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(99 - SETTLE);
    let record = bench.tick();
    assert_eq!(
        (record.state, record.fault),
        (RigState::Faulted, Some(Fault::NonFinitePosition))
    );
    assert_eq!(record.command_force, 0.0);
    assert_eq!(bench.tick().command_force, 0.0, "until a reset");
}

#[test]
fn a_jump_of_the_encoder_faults_before_it_is_rendered() {
    // 2 mm within a millisecond, from a hand at 0.1 m/s: slower than the speed limit, and no
    // motion.
    let jumped = (0..50).map(|k| Ok(0.02 + 2e-3 + 2e-4 * f64::from(k)));
    let limits = Limits {
        acceleration_mps2: 2000.0,
        ..LIMITS
    };
    let mut bench = bench_with(Settings { limits, ..SETTINGS }, ramp().take(100).chain(jumped));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    let mut before = bench.tick();
    while before.state.is_live() {
        let record = bench.tick();
        let step = record.command_force - before.command_force;
        assert!(record.command_force == 0.0 || step.abs() < 1.0, "{before:?} {record:?}");
        before = record;
    }
    assert_eq!(bench.tick.servo.fault(), Some(Fault::Jump));
    assert_eq!(bench.last_written(), 0.0);
}

#[test]
fn a_jump_of_the_encoder_is_cut_to_the_force_limit() {
    let mut bench = bench(ramp().take(100).chain(std::iter::repeat_n(Ok(5.0), 50)));
    bench.tick();
    bench.command(Command::Engage);
    for _ in 2..150 {
        let record = bench.tick();
        assert!(record.command_force.abs() <= MAX_FORCE, "{record:?}");
    }
}

#[test]
fn a_device_that_goes_too_fast_faults_at_zero_force() {
    // 8 m/s, from rest, while it is engaged.
    let fast = (0..200).map(|k| Ok(0.2 * 0.1 + 8e-3 * f64::from(k)));
    let mut bench = bench(ramp().take(100).chain(fast));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(100);
    assert_eq!(bench.tick.servo.fault(), Some(Fault::TooFast));
    assert_eq!(bench.last_written(), 0.0);
}
