//! Samples that are wrong, repeated, impossible or absent.

use super::*;
use device_io::protocol::message::ErrorCode;
use haptic_core::servo::Fault;

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
        let record = bench.tick();
        assert_eq!((record.state, record.fault, record.command_force), (state, fault, 0.0));
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
