//! The conversation with the fake ODrive.

use super::dialect::ODriveDialect;
use super::generation::Generation;
use super::options::ODriveOptions;
use super::text::{Text, TooLong};
use super::virtual_line::{MS, VirtualLine as Line};
use crate::fake::{ODriveBoard, ODriveProperties};
use device_io::fake::{Hand, HandMotion, Misbehaviour, RigProperties};
use device_io::protocol::message::{ErrorCode, ErrorReport};
use device_io::{DeviceError, Motor};
use std::sync::atomic::Ordering::Relaxed;

fn line_with(options: &str, hand: Hand, properties: ODriveProperties) -> Line {
    let options = ODriveOptions::parse("x", Some(options)).expect("right");
    let generation = Generation::of(properties.firmware.map(f64::from)).expect("new enough");
    let mut board = ODriveBoard::new(RigProperties::default(), hand, properties);
    let now_ns = 1000 * MS;
    board.live_until(now_ns);
    let first = board.rig().plant().position_m() / options.metres_per_turn();
    let dialect = ODriveDialect::new(options.axis, generation);
    let scale = options.scale(first, options.torque_limit_nm, Some(3142.0));
    Line::new(dialect, scale, board, now_ns)
}

const OPTIONS: &str = "radius_mm=5&torque_limit_nm=0.1";

fn line() -> Line {
    line_with(OPTIONS, Hand::Free, ODriveProperties::default())
}

#[test]
fn force_flows_only_with_watchdog_on_and_while_wanted() {
    let mut line = line();
    line.ticks(20, 3.0, false);
    assert_eq!((line.board.is_on(), line.board.force_n()), (false, 0.0));
    line.board.take_largest_force_n();
    let mut armed = None;
    for k in 0..100 {
        line.ticks(1, 3.0, true);
        if line.board.is_on() {
            assert_eq!(line.board.watchdog(), Some(0.05), "no closed loop without it");
            armed.get_or_insert(k);
        } else {
            assert_eq!(line.board.force_n(), 0.0);
        }
    }
    assert!(armed.is_some_and(|ticks| ticks < 30), "{armed:?}");
    assert!((line.board.force_n() - 3.0).abs() < 1e-3, "{}", line.board.force_n());
    line.ticks(2, -99.0, true);
    assert!((line.board.force_n() + 20.0).abs() < 1e-3, "cut to the limit");
    assert!(line.count(|counters| &counters.clipped) >= 1);
    line.ticks(1, 3.0, false);
    assert_eq!(line.board.force_n(), 0.0, "in the same tick");
    line.ticks(20, 3.0, false);
    assert_eq!((line.board.is_on(), line.board.watchdog()), (false, None));
    line.ticks(1000, 3.0, false);
    assert_eq!(line.board.error(), 0, "no watchdog bites while it idles");
    let counters = &line.counters;
    let wrong = [
        &counters.bad_crc,
        &counters.malformed,
        &counters.lost,
        &counters.device_errors,
    ];
    assert_eq!(wrong.map(|count| count.load(Relaxed)), [0; 4]);
}

#[test]
fn direction_option_turns_both_position_and_force() {
    for (direction, sign) in [("1", 1.0), ("-1", -1.0)] {
        let options = format!("{OPTIONS}&direction={direction}");
        let mut line = line_with(&options, Hand::Free, ODriveProperties::default());
        let before = line.ticks(100, 0.0, true);
        let sample = line.ticks(500, 3.0, true);
        // 3 N - 0.8 N on 1.4 kg for half a second, and the sample is a tick old.
        let is_there = (0.18..0.2).contains(&sample.position_m);
        assert!(is_there, "{sample:?} with direction {direction}");
        assert_eq!(before.position_m, 0.0);
        assert!(line.board.rig().plant().position_m() * sign > 0.18);
        assert!(sample.sequence > before.sequence + 450);
    }
}

#[test]
fn a_host_that_dies_leaves_no_force() {
    let mut line = line();
    line.ticks(100, 5.0, true);
    assert!(line.board.force_n() > 4.9);
    line.host_is_dead = true;
    let began_ns = line.now_ns;
    while line.board.force_n() != 0.0 {
        line.tick(5.0, true).ok();
        assert!(line.now_ns - began_ns <= 52 * MS, "its watchdog must bite");
    }
    assert!(line.now_ns - began_ns > 45 * MS);
    assert!(line.board.watchdog_has_tripped() && !line.board.is_on());
    // Nothing comes any more: the connection is over.
    let (_, error) = line.ticks_until_failure(1000, 5.0, true).expect("it is reported");
    assert_eq!(error, DeviceError::Disconnected);
}

#[test]
fn watchdog_trip_is_reported_and_cleared_by_enabling() {
    let mut line = line();
    line.ticks(100, 2.0, true);
    line.host_is_dead = true;
    for _ in 0..60 {
        line.tick(2.0, true).ok();
    }
    line.host_is_dead = false;
    let (ticks, error) = line.ticks_until_failure(200, 2.0, true).expect("it is reported");
    assert_eq!(error, DeviceError::MotorOff { watchdog: true });
    assert!(ticks < 80, "{ticks}");
    line.release(30);
    line.ticks(100, 2.0, true);
    assert!(line.board.is_on() && line.board.force_n() > 1.9);
}

fn failed(code: ErrorCode, detail: u32) -> DeviceError {
    DeviceError::Failed(ErrorReport { code, detail })
}

#[test]
fn an_error_of_the_board_alone_is_reported() {
    const DC_BUS_OVER_VOLTAGE: u32 = 4;
    for phase in (0..60).step_by(3) {
        let mut line = line();
        line.ticks(100 + phase, 2.0, true);
        assert!(line.board.is_on());
        line.board.fail_as_a_whole(DC_BUS_OVER_VOLTAGE);
        let (ticks, reported) = line.ticks_until_failure(200, 2.0, true).expect("it is reported");
        assert_eq!(reported, failed(ErrorCode::Other, DC_BUS_OVER_VOLTAGE));
        assert!(ticks <= 60, "{ticks}");
        let (error, _) = line.counters.last_error().expect("it is kept");
        let text = "the device reported: it reports an error of its own (code 255, detail 4 = 0x4)";
        assert_eq!(error.to_string(), text);
        // The next enabling clears it.
        line.release(30);
        line.ticks(100, 2.0, true);
        assert!(line.board.is_on());
    }
    // And while it idles it is at least shown.
    let mut line = line();
    line.ticks(100, 0.0, false);
    line.board.fail_as_a_whole(DC_BUS_OVER_VOLTAGE);
    line.ticks(400, 0.0, false);
    assert_eq!(line.count(|counters| &counters.device_errors), 1);
    assert!(line.counters.last_error().is_some());
}

#[test]
fn an_axis_failure_is_reported_as_what_it_is() {
    for (firmware, bits, error) in [
        ([0, 5, 6], 0x40, failed(ErrorCode::Motor, 0x40)),
        ([0, 5, 6], 0x100, failed(ErrorCode::Sensor, 0x100)),
        ([0, 6, 9], 0x1000, failed(ErrorCode::Motor, 0x1000)),
        ([0, 6, 9], 0x8, failed(ErrorCode::Sensor, 0x8)),
        ([0, 6, 9], 0x800, DeviceError::MotorOff { watchdog: true }),
        // Disarmed by somebody else.
        ([0, 5, 4], 0, DeviceError::MotorOff { watchdog: false }),
    ] {
        let properties = ODriveProperties {
            firmware,
            ..ODriveProperties::default()
        };
        // Whatever was asked last when it fails.
        for phase in (0..40).step_by(3) {
            let mut line = line_with(OPTIONS, Hand::Free, properties);
            line.ticks(100 + phase, 2.0, true);
            assert!(line.board.is_on());
            line.board.fail(bits);
            let (ticks, reported) = line.ticks_until_failure(200, 2.0, true).expect("it is reported");
            assert_eq!(reported, error, "{firmware:?} {bits:#x}");
            // An error at the next question; nothing but a state at the one after that.
            let most = if bits == 0 { 60 } else { 40 };
            assert!(ticks <= most, "{firmware:?} {bits:#x}: {ticks}");
            assert_eq!(line.board.force_n(), 0.0);
        }
    }
}

#[test]
fn sensor_failure_without_force_is_reported() {
    let mut line = line();
    line.ticks(100, 0.0, false);
    line.board.fail(0x100);
    let (ticks, reported) = line.ticks_until_failure(400, 0.0, false).expect("it is reported");
    assert_eq!(reported, failed(ErrorCode::Sensor, 0x100));
    assert!(ticks <= 160, "{ticks}");
}

#[test]
fn a_line_that_is_too_long_counts_as_malformed() {
    let mut line = line();
    line.ticks(20, 0.0, false);
    line.conversation.take(Err(TooLong), line.now_ns);
    assert_eq!(line.count(|counters| &counters.malformed), 1);
}

#[test]
fn an_axis_that_cannot_close_its_loop_is_reported() {
    let properties = ODriveProperties {
        calibrated: false,
        ..ODriveProperties::default()
    };
    let mut line = line_with(OPTIONS, Hand::Free, properties);
    let (ticks, error) = line.ticks_until_failure(400, 2.0, true).expect("it is reported");
    let (code, invalid_state) = (ErrorCode::Motor, 1);
    assert_eq!(error, failed(code, invalid_state));
    assert!(ticks < 50, "{ticks}");
    assert_eq!(line.board.take_largest_force_n(), 0.0);
}

#[test]
fn foreign_closed_loop_is_ended_while_no_force_is_wanted() {
    let mut line = line();
    line.ticks(100, 0.0, false);
    line.board
        .receive(b"c 0 0.05\nw axis0.requested_state 8\n", line.now_ns);
    line.ticks(200, 0.0, false);
    assert!(!line.board.is_on());
    assert_eq!(line.board.force_n(), 0.0);
}

#[test]
fn a_bad_line_loses_samples_and_never_makes_a_wrong_one() {
    let motion = HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    };
    // As the greeting leaves it: a command that loses its checksum is believed, and the board must cut it.
    let properties = ODriveProperties {
        torque_limit_nm: 0.1,
        ..ODriveProperties::default()
    };
    let mut line = line_with(OPTIONS, Hand::Prescribed(motion.clone()), properties);
    line.ticks(50, 1.0, true);
    line.quality.corrupt = 0.05;
    line.quality.loss = 0.05;
    let mut oldest_ns = 0;
    for _ in 0..5000 {
        let Ok(sample) = line.tick(1.0, true) else {
            // A late answer may have been taken for a failure, which is reported: safe, and begun again.
            line.release(50);
            continue;
        };
        // Where the hand was when it was asked for; after lost answers the time is some ticks off.
        #[expect(clippy::cast_precision_loss, reason = "seconds")]
        let exact = motion.at((sample.time_ns - 1000 * MS) as f64 * 1e-9).0 + 0.03;
        let apart_m = (sample.position_m - exact).abs();
        assert!(apart_m < 0.19 * 10e-3, "{sample:?} for {exact}");
        let age_ns = line.now_ns - sample.time_ns;
        oldest_ns = oldest_ns.max(age_ns);
        assert!(line.board.force_n().abs() <= 20.001);
    }
    // One line in ten is lost or damaged, each way, and so is the one that would show it.
    assert!(oldest_ns < 60 * MS, "{oldest_ns}");
    assert!(line.count(|counters| &counters.bad_crc) > 10);
    assert!(line.count(|counters| &counters.lost) > 10);
    assert!(line.count(|counters| &counters.late) > 10);
}

#[test]
fn answers_match_questions_again_after_losses() {
    let mut line = line();
    line.ticks(100, 1.0, true);
    line.quality.loss = 1.0;
    line.ticks(3, 1.0, true);
    line.quality.loss = 0.0;
    let after = line.ticks(60, 1.0, true);
    assert_eq!(line.count(|counters| &counters.lost), 3);
    assert_eq!(line.count(|counters| &counters.round_trip_ns), MS);
    assert_eq!(after.time_ns, line.now_ns - 2 * MS);
}

#[test]
fn a_slow_line_sets_the_pace_and_fills_no_buffer() {
    let mut line = line();
    line.quality.delay_ms = 4.0;
    let before = line.ticks(100, 1.0, true);
    let sent = line.sent.len();
    let after = line.ticks(800, 1.0, true);
    // Four questions in eight milliseconds and two ticks.
    let share = f64::from(after.sequence - before.sequence) / 800.0;
    assert!((0.4..=0.5).contains(&share), "{share}");
    assert!(line.sent.len() - sent < 800 * 25, "{}", line.sent.len() - sent);
    assert!(line.count(|counters| &counters.not_sent) > 300);
    assert!(line.count(|counters| &counters.late) > 300);
    let round_trip = line.count(|counters| &counters.round_trip_ns);
    assert!((8 * MS..=10 * MS).contains(&round_trip), "{round_trip}");
    assert!(line.board.is_on() && (line.board.force_n() - 1.0).abs() < 1e-3);
}

// hazard: H9
#[test]
fn motor_counts_as_off_only_once_axis_confirms() {
    for wrong in [Misbehaviour::IgnoreOff, Misbehaviour::StayEnabled, Misbehaviour::NoEcho] {
        let mut line = line();
        assert_eq!(line.ticks(20, 0.0, false).motor, Motor::Off);
        assert_eq!(line.ticks(100, 3.0, true).motor, Motor::Enabled);
        line.board.misbehave(wrong);
        for k in 0..500 {
            if let Ok(sample) = line.tick(0.0, false) {
                // Nothing has confirmed that it is off.
                assert_eq!(sample.motor, Motor::Enabled, "{wrong:?} after {k} ms");
            }
        }
        line.board.misbehave(Misbehaviour::Honest);
        assert_eq!(line.ticks(200, 0.0, false).motor, Motor::Off, "{wrong:?}");
        assert!(!line.board.is_on());
    }
}

#[test]
fn the_last_word_switches_it_off() {
    let mut line = line();
    line.ticks(100, 3.0, true);
    let mut text = Text::default();
    line.conversation.farewell(&mut text);
    let now_ns = line.now_ns;
    line.board.receive(text.as_bytes(), now_ns);
    line.board.live_until(now_ns + 2 * MS);
    assert_eq!((line.board.is_on(), line.board.force_n()), (false, 0.0));
    // Were the word lost, it would bite.
    assert!(line.board.watchdog().is_some());
}

#[test]
fn a_bad_line_never_leaves_the_motor_on_without_its_watchdog() {
    let mut line = line();
    line.quality.loss = 0.1;
    let mut armed = 0;
    for _ in 0..300 {
        let mut was_on = false;
        for k in 0..200 {
            let failed = line.tick(1.0, k < 180).is_err();
            assert!(!line.board.is_on() || line.board.watchdog() == Some(0.05));
            was_on |= line.board.is_on();
            if failed {
                break;
            }
        }
        armed += u32::from(was_on);
        for _ in 0..50 {
            line.tick(0.0, false).ok();
            assert!(!line.board.is_on() || line.board.watchdog() == Some(0.05));
        }
    }
    assert!(armed > 30, "{armed}");
}
