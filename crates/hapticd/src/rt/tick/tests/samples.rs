//! Samples that are wrong, impossible or absent.

use super::*;
use device_io::protocol::message::ErrorCode;
use haptic_core::servo::Fault;

// hazard: F3, F8, F9, F10, P2
#[test]
fn sample_of_no_hand_or_of_a_failing_device_ends_the_force() {
    let steadily = |from_m: f64, step_m: f64| (0..50).map(|k| Ok(from_m + step_m * f64::from(k))).collect();
    let faulted = |fault| (RigState::Faulted, Some(fault));
    let off = DeviceError::MotorOff { watchdog: true };
    let sensor = ErrorCode::Sensor.into();
    let (failed, gone) = (DeviceError::Failed(sensor), DeviceError::Disconnected);
    for (what, readings, (state, fault)) in [
        ("no number", vec![Ok(f64::NAN)], faulted(Fault::NonFinitePosition)),
        (
            "a watchdog",
            vec![Err(off)],
            faulted(Fault::MotorOff { watchdog: true }),
        ),
        ("a sensor", vec![Err(failed)], faulted(Fault::Device(sensor))),
        ("no device", vec![Err(gone)], (RigState::Disconnected, None)),
        ("8 m/s", steadily(0.02, 8e-3), faulted(Fault::TooFast)),
        // From a hand at 0.2 m/s: slower than the speed limit, and no motion.
        ("a jump by 2 mm", steadily(0.022, 2e-4), faulted(Fault::Jump)),
    ] {
        let is_jump = fault == Some(Fault::Jump);
        let limits = Limits {
            acceleration_mps2: if is_jump { 2000.0 } else { LIMITS.acceleration_mps2 },
            ..LIMITS
        };
        let readings = ramp().take(100).chain(readings).chain(ramp());
        let mut bench = bench_with(Settings { limits, ..SETTINGS }, readings);
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        let mut last = bench.tick();
        while last.state.is_live() {
            let record = bench.tick();
            let step_n = record.command_force - last.command_force;
            let is_rendered = is_jump && record.command_force != 0.0 && step_n.abs() >= 1.0;
            assert!(!is_rendered, "{last:?} {record:?}");
            last = record;
        }
        assert_eq!(
            (last.state, last.fault, last.command_force),
            (state, fault, 0.0),
            "{what}"
        );
        assert_eq!(bench.last_written(), 0.0, "{what}");
        assert_eq!(bench.tick().command_force, 0.0, "until somebody engages: {what}");
    }
}
