//! Force comes with engaging, along a ramp, and begins at zero.

use super::*;

#[test]
fn force_begins_on_engaging_and_ends_with_a_stop() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    assert_eq!(bench.last_written(), 0.0);
    assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
    bench.ticks(300);
    let record = bench.tick();
    assert_eq!(record.state, RigState::Engaged);
    assert!((record.command_force + 3.5).abs() < 0.05, "{record:?}");
    assert_eq!(record.contact, 1);
    let stop = bench.shared.stop();
    assert_eq!(bench.tick().command_force, 0.0);
    assert_eq!(
        bench.records.answers().stop(stop).map(|stopped| stopped.state),
        Some(RigState::Stopped)
    );
    assert!(bench.command(Command::Engage).refused, "a stop holds until a reset");
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert_eq!(bench.last_written(), 0.0, "a reset does not engage");
}

#[test]
fn engaging_begins_without_force_wherever_and_whenever_it_comes() {
    // In the very first tick, far from the origin; and after a device that was gone has come back
    // elsewhere.
    let away = || std::iter::repeat_n(Err(DeviceError::Disconnected), 1);
    let readings = std::iter::repeat_n(Ok(-0.03), 50)
        .chain(away())
        .chain(std::iter::repeat_n(Ok(0.4), 50));
    let mut bench = bench(readings);
    let still = |bench: &mut Bench| {
        bench.serial += 1;
        bench.inbox.command(bench.serial, Command::Engage, bench.shared.stops());
        for _ in 0..30 {
            let record = bench.tick();
            assert_eq!((record.coupling_force, record.command_force), (0.0, 0.0), "{record:?}");
        }
        assert_eq!(bench.tick().state, RigState::Engaged);
    };
    still(&mut bench);
    bench.ticks(50 - 31);
    assert_eq!(bench.tick().state, RigState::Disconnected);
    assert_eq!(bench.tick().state, RigState::Idle);
    still(&mut bench);
}

#[test]
fn passivity_controller_force_grows_with_the_ramp() {
    const CONTROL_N: f64 = 3.0;
    // A hand that trembles on a stiff coupling, along a ramp of a second.
    let run = |control_n: f64| {
        let tremble = (0..400).map(|k| Ok(1e-4 * (0.8 * f64::from(k)).sin()));
        let settings = Settings {
            ramp_s: 1.0,
            passivity_control_n: control_n,
            ..SETTINGS
        };
        let mut bench = bench_with(settings, tremble);
        bench.command(Command::Engage);
        let records: Vec<TickRecord> = (0..350).map(|_| bench.tick()).collect();
        records
    };
    let (watched, controlled) = (run(0.0), run(CONTROL_N));
    let mut added = false;
    for (k, (watched, controlled)) in (1..).zip(watched.iter().zip(&controlled)) {
        let gain = 1e-3 * f64::from(k);
        let most = gain * (controlled.coupling_force.abs() + CONTROL_N) + 1e-9;
        assert!(controlled.command_force.abs() <= most, "{most}: {controlled:?}");
        added |= controlled.command_force != watched.command_force;
    }
    assert!(added, "the controller had nothing to do");
    // As long as the gain is next to nothing so is what it takes out, and it must know that.
    let (watched, controlled) = (watched[10].energy_excess, controlled[10].energy_excess);
    assert!(
        watched > 0.0 && (controlled / watched - 1.0).abs() < 0.1,
        "{watched} J, {controlled} J"
    );
}

// hazard: P3, P4, P5
#[test]
fn the_motor_is_enabled_while_force_may_flow_and_never_else() {
    let mut bench = bench(ramp());
    let last = |bench: &mut Bench| {
        let record = bench.tick();
        (
            record.state.is_live(),
            bench
                .tick
                .device
                .enabled
                .last()
                .copied()
                .expect("written in every tick"),
        )
    };
    for _ in 0..SETTLE {
        assert_eq!(last(&mut bench), (false, false));
    }
    bench.command(Command::Engage);
    for _ in 0..100 {
        assert_eq!(last(&mut bench), (true, true));
    }
    bench.shared.stop();
    assert_eq!(last(&mut bench), (false, false));
    bench.command(Command::Reset);
    bench.engage();
    // A write that fails takes the rig with it.
    bench.tick.device.writing = Err(DeviceError::Disconnected);
    assert_eq!(bench.tick().state, RigState::Disconnected);
    bench.tick.device.writing = Ok(Written::Taken);
    assert!(!last(&mut bench).1);
    assert!(bench.tick.zero_force(0).is_ok());
    assert_eq!(bench.tick.device.enabled.last(), Some(&false), "the last word");
}

// hazard: P8, P9
#[test]
fn nothing_of_the_force_before_a_stop_is_left_after_it() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.ticks(200);
    // A change of scene whose step of force is still fading, and an energy account with something
    // in it.
    bench.inbox.post(compiled(&scenes()[6], 2));
    bench.ticks(5);
    bench.shared.stop();
    bench.tick();
    assert_eq!(bench.tick().energy_excess, 0.0);
    bench.inbox.post(compiled(&Scene::paper(), 3));
    bench.command(Command::Reset);
    bench.command(Command::Engage);
    let first = bench.tick();
    assert!(first.command_force.abs() < 0.1, "force begins again: {first:?}");
}
