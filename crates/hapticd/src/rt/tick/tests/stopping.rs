//! A stop and its confirmation, and a control thread that hangs.

use super::*;
use haptic_core::servo::Fault;

#[test]
fn stop_is_confirmed_only_after_device_takes_zero_force() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(50);
    // A link that is busy: the zero force waits.
    bench.tick.device.writing = Ok(Written::Later);
    let stop = bench.shared.stop();
    bench.ticks(5);
    assert_eq!(bench.records.answers().stop(stop), None);
    // Another has seen the stop and resets; force may not come before the zero force has gone.
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert!(bench.command(Command::Engage).refused);
    assert_eq!(bench.records.answers().stop(stop), None);
    bench.tick.device.writing = Ok(Written::Taken);
    let tick = bench.tick().tick;
    let stopped = bench.records.answers().stop(stop).expect("confirmed");
    assert_eq!(
        (stopped.tick, stopped.state, stopped.confirmation),
        (tick, RigState::Stopped, StopConfirmation::Confirmed)
    );
    assert_eq!(stopped.written_ns, stopped.confirmed_ns, "not when the link was busy");
    assert_eq!(bench.last_written(), 0.0);
    assert!(!bench.command(Command::Engage).refused);
}

// hazard: H12
#[test]
fn stops_again_and_again_do_not_put_off_the_answer() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.tick.device.motor = Motor::Unconfirmed;
    let stop = bench.shared.stop();
    for _ in 0..3 {
        bench.ticks(40);
        bench.shared.stop();
    }
    let confirmation = bench.records.answers().stop(stop).map(|stopped| stopped.confirmation);
    assert_eq!(confirmation, Some(StopConfirmation::Unconfirmed));
}

#[test]
fn a_reset_that_a_stop_has_overtaken_clears_nothing() {
    let mut bench = bench(ramp());
    bench.shared.stop();
    bench.tick();
    bench.inbox.command(7, Command::Reset, bench.shared.stops());
    bench.shared.stop();
    bench.tick();
    let outcome = bench.records.answers().command(7).expect("answered");
    assert!(outcome.refused);
    assert_eq!(outcome.state, RigState::Stopped);
}

// hazard: H2
#[test]
fn hanging_control_thread_ends_force_within_300_ms() {
    let mut bench = bench_with(
        Settings {
            ramp_s: 10.0,
            ..SETTINGS
        },
        ramp(),
    );
    bench.shared.heartbeat(bench.clock_ns);
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    // Of a ramp of ten seconds a tenth is gone.
    for _ in 0..1000 {
        // Not a whole number of ticks before any of them.
        bench.shared.heartbeat(bench.clock_ns + 1);
        assert!(bench.tick().state.is_live());
    }
    let lost_ns = bench.clock_ns;
    let mut last = bench.tick();
    while last.state.is_live() {
        let record = bench.tick();
        assert!(
            (record.command_force - last.command_force).abs() < 0.5,
            "no jump: {last:?} {record:?}"
        );
        last = record;
    }
    assert_eq!((last.state, last.fault), (RigState::Faulted, Some(Fault::ControlLost)));
    let took_ns = bench.clock_ns - lost_ns;
    assert!((240_000_000..=300_000_000).contains(&took_ns), "{took_ns} ns");
    // It comes to itself: that alone brings no force back.
    bench.shared.heartbeat(bench.clock_ns);
    assert!(bench.command(Command::Engage).refused);
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert!(!bench.command(Command::Engage).refused);
}
