//! The conversation with the fake SimpleFOC board.

use super::dialect::SimpleFocDialect;
use super::options::SimpleFocOptions;
use crate::fake::{FakeBoard, SimpleFocBoard, SimpleFocProperties};
use crate::text::Text;
use crate::virtual_line::{MS, VirtualLine};
use device_io::DeviceError;
use device_io::fake::{Hand, RigProperties};

type Line = VirtualLine<SimpleFocDialect, SimpleFocBoard>;

fn line_with(options: &str, properties: SimpleFocProperties) -> Line {
    let options = format!("radius_mm=5&torque_limit_nm=0.1&nm_per_unit=0.05{options}");
    let options = SimpleFocOptions::parse("x", Some(&options)).expect("right");
    let mut board = SimpleFocBoard::new(RigProperties::default(), Hand::Free, properties);
    let now_ns = 1000 * MS;
    // As the greeting leaves it, but for what the conversation must do itself.
    board.receive(b"@3\n#6\n", now_ns);
    VirtualLine::new(options.dialect(2.0), options.scale(0.0, 2.0), board, now_ns)
}

fn line() -> Line {
    line_with("", SimpleFocProperties::default())
}

#[test]
fn force_flows_while_it_is_wanted_and_every_command_is_short_enough() {
    let mut line = line();
    assert!(line.board.is_on(), "its set-up leaves it enabled");
    line.ticks(20, 3.0, false);
    assert_eq!((line.board.is_on(), line.board.force_n()), (false, 0.0));
    line.ticks(30, 3.0, true);
    assert!((line.board.force_n() - 3.0).abs() < 1e-3, "{}", line.board.force_n());
    line.ticks(2, -99.0, true);
    assert!((line.board.force_n() + 20.0).abs() < 1e-3, "cut to the limit");
    line.ticks(1, 3.0, false);
    assert_eq!(
        (line.board.is_on(), line.board.force_n()),
        (false, 0.0),
        "in the same tick"
    );
    line.ticks(500, 3.0, false);
    assert!(!line.board.is_on());
    for command in line.said.split_inclusive(|byte| *byte == b'\n') {
        assert!(command.len() < 20, "{}", String::from_utf8_lossy(command));
    }
    assert_eq!(line.count(|counters| &counters.malformed), 0);
    assert_eq!(line.count(|counters| &counters.lost), 0);
    assert_eq!(line.count(|counters| &counters.device_errors), 0);
}

#[test]
fn the_handle_is_where_the_shaft_is_and_force_pulls_where_it_is_positive_either_way_round() {
    for (direction, sign) in [("", 1.0), ("&direction=-1", -1.0)] {
        let mut line = line_with(direction, SimpleFocProperties::default());
        line.ticks(100, 0.0, true);
        let sample = line.ticks(500, 3.0, true);
        assert!((0.18..0.2).contains(&sample.position_m), "{sample:?}{direction}");
        assert!(line.board.rig().plant().position_m() * sign > 0.18);
    }
}

#[test]
fn without_a_time_out_in_the_firmware_force_stays_and_with_one_it_ends() {
    for (host_timeout_ns, force_n) in [(None, 5.0), (Some(50 * MS), 0.0)] {
        let properties = SimpleFocProperties {
            host_timeout_ns,
            ..SimpleFocProperties::default()
        };
        let mut line = line_with("", properties);
        line.ticks(100, 5.0, true);
        assert!((line.board.force_n() - 5.0).abs() < 1e-3);
        line.host_is_dead = true;
        for _ in 0..100 {
            line.tick(5.0, true).ok();
        }
        // The limit that docs/adapters.md states.
        assert!(
            (line.board.force_n() - force_n).abs() < 1e-3,
            "{}",
            line.board.force_n()
        );
    }
}

#[test]
fn a_board_that_does_not_control_torque_is_given_no_target() {
    let properties = SimpleFocProperties {
        keeps_angle: true,
        ..SimpleFocProperties::default()
    };
    let mut line = line_with("", properties);
    let (ticks, error) = line.ticks_until_failure(400, 5.0, true).expect("it is reported");
    assert_eq!(error, DeviceError::MotorOff { watchdog: false });
    assert!((300..310).contains(&ticks), "{ticks}");
    let said = String::from_utf8(line.said.clone()).expect("text");
    for target in said.lines().filter_map(|line| line.strip_prefix('M')) {
        assert!(target.parse::<f64>().unwrap_or(0.0) == 0.0, "{target}");
    }
    line.release(20);
    assert!(!line.board.is_on());
}

#[test]
fn a_motor_that_is_disabled_behind_our_back_is_told() {
    let mut line = line();
    line.ticks(100, 2.0, true);
    line.board.disable();
    let (ticks, error) = line.ticks_until_failure(100, 2.0, true).expect("it is reported");
    assert_eq!(error, DeviceError::MotorOff { watchdog: false });
    assert!(ticks <= 20, "{ticks}");
    line.release(20);
    line.ticks(50, 2.0, true);
    assert!(line.board.is_on() && line.board.force_n() > 1.9);
}

#[test]
fn whoever_else_enables_it_while_no_force_is_wanted_is_overruled() {
    let mut line = line();
    line.ticks(100, 0.0, false);
    line.board.receive(b"ME1\nM1\n", line.now_ns);
    line.ticks(200, 0.0, false);
    assert!(!line.board.is_on());
}

#[test]
fn a_board_that_has_begun_anew_speaks_to_people_and_is_gone() {
    let mut line = line();
    line.ticks(100, 2.0, true);
    line.board.receive(b"@2\n", line.now_ns);
    assert_eq!(
        line.ticks_until_failure(1000, 2.0, true).map(|(_, error)| error),
        Some(DeviceError::Disconnected)
    );
    assert!(line.count(|counters| &counters.malformed) > 10);
}

#[test]
fn a_bad_line_loses_samples_and_a_jump_that_no_hand_makes_is_none() {
    let mut line = line();
    line.ticks(50, 0.0, true);
    line.quality.corrupt = 0.05;
    let mut was = 0.0;
    for _ in 0..5000 {
        // Damage may be taken for what was said: only what no hand does can be told.
        match line.tick(0.0, true) {
            Ok(sample) => {
                assert!((sample.position_m - was).abs() < 0.25, "{sample:?} after {was}");
                was = sample.position_m;
            }
            _ => line.release(30),
        }
    }
    assert!(line.count(|counters| &counters.malformed) > 50);
    assert!(line.count(|counters| &counters.lost) > 10);
}

#[test]
fn the_last_word_switches_it_off() {
    let mut line = line();
    line.ticks(100, 3.0, true);
    let mut text = Text::default();
    line.conversation.farewell(&mut text);
    line.board.receive(text.as_bytes(), line.now_ns);
    assert_eq!((line.board.is_on(), line.board.force_n()), (false, 0.0));
}
