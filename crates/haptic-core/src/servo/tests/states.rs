//! What a person, the loop and the device's own words do to the state of the rig, and what is made
//! of samples that no hand can have made.

use super::script::{PLAIN, SPEED_MPS};
use super::*;
use crate::sample::ErrorCode;
use crate::sample_clock::ClockError;

const STOP_BUTTON: u8 = 1 << 2;
const ENABLE_BUTTON: u8 = 1 << 5;

const WITH_BUTTONS: Settings = Settings {
    stop_button: Some(2),
    enable_button: Some(5),
    ..PLAIN
};

fn ended(script: &Script) -> (RigState, Option<Fault>) {
    (script.servo.state(), script.servo.fault())
}

// hazard: P7
#[test]
fn a_ramp_takes_its_time_whatever_the_devices_clock_does() {
    let mut script = Script::new(PLAIN);
    script.go_on(50);
    script.command(Command::Engage);
    for k in 1..=20 {
        script.once.device_elapsed_ns = MS / 2;
        script.next();
        let state = if k < 20 { RigState::Engaging } else { RigState::Engaged };
        assert_eq!((k, script.servo.state()), (k, state));
    }
}

#[test]
fn missed_time_faults_only_while_force_flows() {
    let nothing = Events::default();
    let slept = Events::from(Event::Slept);
    let too_late = Events::from(Event::TooLate);
    for (elapsed_ns, events, fault) in [
        (MS, nothing, None),
        (50 * MS, nothing, None),
        (50 * MS + 1, nothing, Some(Fault::Stalled)),
        (MS, slept, Some(Fault::Stalled)),
        (MS, too_late, Some(Fault::TooLate)),
        (60 * MS, too_late, Some(Fault::Stalled)),
    ] {
        for live in [true, false] {
            let mut script = Script::engaged(PLAIN);
            if !live {
                script.command(Command::Release);
                script.until_released();
            }
            script.once.events = events;
            (script.once.elapsed_ns, script.once.device_elapsed_ns) = (elapsed_ns, elapsed_ns);
            let outputs = script.next();
            let expected = match (live, fault) {
                (false, _) => (RigState::Idle, None),
                (true, None) => (RigState::Engaged, None),
                (true, fault) => (RigState::Faulted, fault),
            };
            assert_eq!(ended(&script), expected, "{elapsed_ns} ns, {events:?}");
            assert_eq!(outputs.force_n == 0.0, expected.0 != RigState::Engaged);
        }
    }
}

#[test]
fn a_loop_that_may_stand_still_does_not_fault_by_it() {
    let mut script = Script::engaged(PLAIN);
    script.servo.disregard_stalls();
    (script.once.elapsed_ns, script.once.device_elapsed_ns) = (1000 * MS, 1000 * MS);
    script.next();
    assert_eq!(ended(&script), (RigState::Engaged, None));
}

// hazard: H15
#[test]
fn lapsed_lease_or_lost_control_cuts_a_long_ramp_short() {
    let settings = Settings { ramp_s: 1.0, ..PLAIN };
    let mut script = Script::engaged(settings);
    script.once.events = Event::LeaseLapsed.into();
    let took = script.until_released();
    assert!((200..=201).contains(&took), "{took} ms");
    assert_eq!(ended(&script), (RigState::Idle, None));
    let mut script = Script::engaged(settings);
    script.once.events = Event::ControlLost.into();
    let took = script.until_released();
    assert!((40..=41).contains(&took), "{took} ms");
    assert_eq!(ended(&script), (RigState::Faulted, Some(Fault::ControlLost)));
}

#[test]
fn engage_needs_enable_button_and_motor_with_force() {
    for (buttons, force_n, refused) in [
        (ENABLE_BUTTON, 20.0, false),
        (0, 20.0, true),
        (!ENABLE_BUTTON & !STOP_BUTTON, 20.0, true),
        (ENABLE_BUTTON | STOP_BUTTON, 20.0, true),
        (ENABLE_BUTTON, 0.0, true),
        (0, 0.0, true),
    ] {
        let mut script = Script::new(WITH_BUTTONS);
        script.sample.buttons = buttons;
        script.device_force_limit_n = force_n;
        script.go_on(50);
        // Only force waits for them.
        assert!(!script.command(Command::Reset), "{buttons:#b}, {force_n} N");
        assert_eq!(script.command(Command::Engage), refused, "{buttons:#b}, {force_n} N");
        assert_eq!(script.servo.state() == RigState::Engaging, !refused);
    }
    let mut script = Script::new(PLAIN);
    script.device_force_limit_n = 0.0;
    script.go_on(50);
    assert!(
        !script.command(Command::Release),
        "a motor without force may be released"
    );
}

// hazard: H19
#[test]
fn stop_button_stops_and_enable_button_releases() {
    for (buttons, expected) in [
        (ENABLE_BUTTON, (RigState::Engaged, None)),
        (!STOP_BUTTON, (RigState::Engaged, None)),
        (0, (RigState::Idle, None)),
        (!STOP_BUTTON & !ENABLE_BUTTON, (RigState::Idle, None)),
        (
            ENABLE_BUTTON | STOP_BUTTON,
            (RigState::Stopped, Some(Fault::StopButton)),
        ),
    ] {
        let mut script = Script::new(WITH_BUTTONS);
        script.sample.buttons = ENABLE_BUTTON;
        script.go_on(50);
        script.command(Command::Engage);
        script.go_on(50);
        script.sample.buttons = buttons;
        let outputs = script.next();
        assert_eq!(ended(&script), expected, "{buttons:#b}");
        assert_eq!(outputs.enabled, expected.0 == RigState::Engaged);
    }
    // A bit that the device does not have is never pressed.
    let mut script = Script::engaged(Settings {
        stop_button: Some(8),
        ..PLAIN
    });
    script.sample.buttons = u8::MAX;
    script.go_on(10);
    assert_eq!(ended(&script), (RigState::Engaged, None));
}

#[test]
fn buttons_of_a_device_that_is_gone_are_not_pressed() {
    let mut script = Script::new(WITH_BUTTONS);
    script.sample.buttons = ENABLE_BUTTON | STOP_BUTTON;
    script.next();
    assert_eq!(script.servo.state(), RigState::Stopped);
    for error in [DeviceError::Disconnected, DeviceError::Failed(ErrorCode::Sensor.into())] {
        script.once.command = Some(Command::Reset);
        script.fail(error);
        assert_ne!(script.servo.state(), RigState::Stopped, "{error:?}");
        script.next();
    }
}

#[test]
fn unwritable_device_disconnects_and_returns_without_force() {
    let mut script = Script::engaged(PLAIN);
    script.servo.disconnect();
    assert_eq!(script.servo.state(), RigState::Disconnected);
    assert_eq!(script.next().force_n, 0.0);
    assert_eq!(ended(&script), (RigState::Idle, None));
    assert_eq!(script.next().force_n, 0.0);
}

#[test]
fn reconnected_or_other_device_starts_at_any_place_and_time() {
    for (is_other, state) in [(false, RigState::Idle), (true, RigState::Engaged)] {
        let mut script = Script::engaged(PLAIN);
        if is_other {
            script.servo.forget_device();
        } else {
            script.fail(DeviceError::Disconnected);
            assert_eq!(script.servo.state(), RigState::Disconnected);
        }
        // Of the same sequence.
        (script.sample.position_m, script.sample.time_ns) = (0.7, 7);
        let outputs = script.repeat();
        assert_eq!(outputs.device_position_m, 0.7);
        assert_eq!(outputs.device_velocity_mps, 0.0, "nothing is known of its motion");
        assert_eq!(ended(&script), (state, None));
    }
}

#[test]
fn a_lying_clock_is_a_fault_while_force_flows_and_else_is_none() {
    let mut script = Script::engaged(PLAIN);
    script.once.device_elapsed_ns = 80 * MS;
    let outputs = script.step(script.sample.position_m);
    let fault = script.servo.fault();
    assert!(matches!(fault, Some(Fault::DeviceClock(_))), "{fault:?}");
    assert_eq!(outputs.force_n, 0.0);
    let mut script = Script::new(PLAIN);
    script.go_on(50);
    script.once.device_elapsed_ns = 80 * MS;
    let outputs = script.step(0.7);
    assert_eq!(ended(&script), (RigState::Idle, None));
    assert_eq!((outputs.device_position_m, outputs.device_velocity_mps), (0.7, 0.0));
}

#[test]
fn clock_in_doubt_without_force_is_named_for_a_second() {
    // A clock that jumps, one that stands still, and a right one whose samples come late.
    for (device_elapsed_ns, elapsed_ns, named) in [
        (80 * MS, MS, Some(ClockError::Jumped)),
        (0, MS, Some(ClockError::StoodStill)),
        (MS, 80 * MS, None),
    ] {
        let mut script = Script::new(PLAIN);
        // Its period is known.
        script.go_on(3000);
        for _ in 0..8 {
            (script.once.device_elapsed_ns, script.once.elapsed_ns) = (device_elapsed_ns, elapsed_ns);
            script.next();
            // One that stands still does so at every sample.
            script.go_on(if device_elapsed_ns == 0 { 0 } else { 3 });
        }
        assert_eq!(
            (script.servo.clock_error(), ended(&script)),
            (named, (RigState::Idle, None))
        );
        // Another servo goes on with it. A line has no workspace to be outside of.
        let fields: BTreeMap<_, _> = script.servo.snapshot().expect("a scene's").fields().collect();
        assert!(!fields.keys().any(|name| name.ends_with("outside_s")));
        let other = Servo::restored(PLAIN, paper(), None, &|name| fields.get(name).copied()).expect("all fields");
        assert_eq!(other.clock_error(), named);
        script.go_on(1001);
        assert_eq!(script.servo.clock_error(), None);
    }
}

#[test]
fn a_new_device_is_estimated_by_its_own_resolution() {
    // What a hand at a steady speed scatters by, counted by 1 mm on a device that says so, or says that it counts none.
    let scatter_mps = |resolution_m: f64| {
        let mut script = Script::new(Settings {
            velocity: velocity::Method::FoawBestFit,
            ..SETTINGS
        });
        script.device_resolution_m = resolution_m;
        let speeds = (0..400).map(|k| {
            let counted_m = 1e-3 * libm::round(f64::from(k) * 1e-3 * SPEED_MPS / 1e-3);
            (script.step(counted_m).device_velocity_mps - SPEED_MPS).abs()
        });
        speeds.skip(200).fold(0.0, f64::max)
    };
    let (known, unknown) = (scatter_mps(1e-3), scatter_mps(0.0));
    assert!(known < 0.5 * unknown, "{known} and {unknown} m/s");
}

#[test]
fn other_limits_hold_under_force_too() {
    let mut script = Script::engaged(PLAIN);
    assert!(script.next().force_n.abs() > 3.0);
    let limits = Limits {
        force_n: 2.0,
        ..SETTINGS.limits
    };
    script.servo.set_limits(limits);
    script.go_on(100);
    assert_eq!(script.next().force_n.abs(), 2.0);
    assert_eq!(script.servo.settings().limits, limits);
}

// hazard: H6
#[test]
fn lone_wrong_sample_is_held_back_and_counted() {
    let mut script = Script::engaged(PLAIN);
    let honest_m = script.next().device_position_m;
    assert_eq!(script.servo.samples_forgotten(), 0);
    for count in 1..=2_u32 {
        let before_m = honest_m + f64::from(2 * count - 2) * SPEED_MPS * 1e-3;
        let outputs = script.step(before_m + 0.01);
        assert_eq!(outputs.device_position_m, before_m, "it is held back");
        let next_m = before_m + 2.0 * SPEED_MPS * 1e-3;
        assert_eq!(script.step(next_m).device_position_m, next_m);
        assert_eq!(script.servo.samples_forgotten(), u64::from(count));
    }
    assert_eq!(ended(&script), (RigState::Engaged, None));
}

// hazard: H25
#[test]
fn agreeing_wrong_samples_stay_within_slew_limit() {
    let step_n = PLAIN.limits.slew_n_per_s * 1e-3 * (1.0 + 1e-9);
    for wrong_m in [0.1e-3, 0.2e-3, 0.3e-3, 0.6e-3, 0.9e-3, -0.2e-3, -0.6e-3, -0.9e-3] {
        for many in 1..=5 {
            let mut script = Script::engaged(PLAIN);
            let mut last_n = script.next().force_n;
            let mut honest_m = script.sample.position_m;
            for k in 0..20 {
                honest_m += SPEED_MPS * 1e-3;
                let position_m = if k < many { honest_m + wrong_m } else { honest_m };
                let force_n = script.step(position_m).force_n;
                let grown_n = if last_n * force_n < 0.0 {
                    last_n.abs() + force_n.abs()
                } else {
                    force_n.abs() - last_n.abs()
                };
                assert!(
                    grown_n <= step_n,
                    "{many} of {wrong_m} m: from {last_n} N to {force_n} N in tick {k}"
                );
                last_n = force_n;
            }
        }
    }
}

// hazard: H25
#[test]
fn a_glitch_that_a_stiff_surface_would_make_felt_is_held() {
    // The paper's coupling: 5 N in a tick are 0.14 mm.
    let mut script = Script::engaged(PLAIN);
    let before_n = script.next().force_n;
    let honest_m = script.sample.position_m + SPEED_MPS * 1e-3;
    let held = script.step(honest_m + 0.2e-3);
    assert!(
        (held.force_n - before_n).abs() < 0.1,
        "{} N, {before_n} N before",
        held.force_n
    );
    let after = script.step(honest_m + SPEED_MPS * 1e-3);
    assert!(
        (after.force_n - before_n).abs() < 0.1,
        "{} N, {before_n} N before",
        after.force_n
    );
    assert_eq!(script.servo.samples_forgotten(), 1);
}

#[test]
fn without_force_the_hand_is_wherever_the_device_says() {
    let mut script = Script::new(PLAIN);
    script.go_on(50);
    assert_eq!(script.step(0.7).device_position_m, 0.7);
    // In the step that engages no force flows yet.
    script.once.command = Some(Command::Engage);
    assert_eq!(script.step(-0.3).device_position_m, -0.3);
    assert_eq!(script.servo.state(), RigState::Engaging);
    // And in the one that stops none any more.
    let mut script = Script::engaged(PLAIN);
    script.once.events = Event::Stop.into();
    assert_eq!(script.step(0.7).device_position_m, 0.7);
    assert_eq!(ended(&script), (RigState::Stopped, None));
}

#[test]
fn a_motor_is_an_alarm_only_where_it_stays_on_without_force() {
    for (motor, live, alarmed) in [
        (Motor::Enabled, false, true),
        (Motor::Enabled, true, false),
        (Motor::Unconfirmed, false, false),
        (Motor::Off, false, false),
        (Motor::Unreported, false, false),
    ] {
        let mut script = if live {
            Script::engaged(PLAIN)
        } else {
            Script::new(PLAIN)
        };
        script.sample.motor = motor;
        script.go_on(300);
        assert_eq!(script.servo.motor(), motor);
        let fault = alarmed.then_some(Fault::StillEnabled);
        assert_eq!(script.servo.fault(), fault, "{motor:?}, {live}");
    }
}

#[test]
fn a_motor_of_a_slow_rig_has_three_periods_to_go_off() {
    let period_ns = 50 * MS;
    let mut script = Script::new(Settings {
        period_s: 0.05,
        stale_ns: 500 * MS,
        ..PLAIN
    });
    script.sample.motor = Motor::Enabled;
    let step = |script: &mut Script| {
        (script.once.elapsed_ns, script.once.device_elapsed_ns) = (period_ns, period_ns);
        script.next();
        script.servo.fault()
    };
    for k in 0..=3 {
        assert_eq!((k, step(&mut script)), (k, None));
    }
    assert_eq!(step(&mut script), Some(Fault::StillEnabled));
}
