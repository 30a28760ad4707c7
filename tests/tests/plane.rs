//! Rigs of two axes: a gantry in the daemon, and a five-bar linkage behind a serial line that has to be homed and
//! commissioned before it pulls.

use haptic_ipc::{
    AdviceReply, Client, CommissionReply, ErrorCode, Event, LossSource, Request, RigState, Sample, SampleY, StateReply,
    Status, Topic,
};
use system_tests::commissioning::{daemon as idle_daemon, lease};
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, engage, refused, status, subscribe, timed, until_some, wait_for, wait_for_state};

const FIVE_BAR: &str = r#"
kinematics = "five-bar"
base_m = 0.038
proximal_m = 0.070
distal_m = 0.090
home_deg = [180.0, 0.0]
workspace_m = { x = [-0.06, 0.06], y = [0.06, 0.13] }
"#;

/// The first rows of both axes that something holds of.
fn rows_where(daemon: &Daemon, what: &str, holds: impl Fn(&Sample, &SampleY) -> bool) -> (Sample, SampleY) {
    let mut client = daemon.client();
    let columns = subscribe(&mut client, &[Topic::Samples]).columns;
    assert_eq!(columns.len(), 27, "{columns:?}");
    until_some(what, || match client.next_event() {
        Ok(Event::Samples(samples)) => {
            assert_eq!(samples.rows.len(), samples.rows_y.len());
            let mut rows = samples.rows.into_iter().zip(samples.rows_y);
            rows.find(|(row, y)| holds(row, y))
        }
        _ => None,
    })
}

#[test]
fn circle_on_the_gantry_feels_friction_against_its_motion() {
    let daemon = Daemon::start_on("fake", &["--kinematics", "xy", "--hand", "circle"]);
    let mut client = daemon.client();
    let device = status(&mut client).device;
    assert_eq!((device.axes, device.kinematics.as_deref()), (2, Some("xy")));
    engage(&mut client);
    let (row, y) = rows_where(&daemon, "a slide", |row, y| {
        let speed = row.device_velocity_mps.hypot(y.device_velocity_mps);
        row.state == RigState::Engaged && row.contact == 1 && speed > 0.05
    });
    let force_n = row.command_force_n.hypot(y.command_force_n);
    assert!((3.0..4.5).contains(&force_n), "{force_n} N: {row:?} {y:?}");
    let power_w = row.command_force_n * row.device_velocity_mps + y.command_force_n * y.device_velocity_mps;
    let speed = row.device_velocity_mps.hypot(y.device_velocity_mps);
    assert!(
        power_w < -0.9 * force_n * speed,
        "it pulls against the motion: {row:?} {y:?}"
    );
    let stopped: StateReply = client.request(Request::Stop {}).expect("a stop");
    assert_eq!(stopped.state, RigState::Stopped);
    let (row, y) = rows_where(&daemon, "a stop", |row, _| row.state == RigState::Stopped);
    assert_eq!((row.command_force_n, y.command_force_n), (0.0, 0.0));
}

#[test]
fn what_a_rig_of_two_axes_has_not_is_refused_by_name() {
    let daemon = Daemon::start_on("fake", &["--kinematics", "xy"]);
    for (line, why) in [
        (
            "set Fs+=5",
            "static_force differs by direction, and in the plane there is none",
        ),
        ("scene load lugre", "the law `lugre` is for a rig of one axis"),
        ("home", "only kinematics with `home_deg` have one"),
    ] {
        daemon.ctl_refused(&line.split(' ').collect::<Vec<_>>(), 1, why);
    }
    let mut client = daemon.client();
    let error = refused(&mut client, Request::commission(None));
    assert_eq!(error.code, ErrorCode::NotApplicable, "{error}");
    assert!(error.message.contains("name `motor` 1 or 2"), "{error}");
}

/// A five-bar linkage whose hand rests in the home pose, and the option of its kinematics.
fn five_bar(directory: &tempfile::TempDir, more: &[&str]) -> (FakeRig, String) {
    let file = directory.path().join("five-bar.toml");
    std::fs::write(&file, FIVE_BAR).expect("a file");
    let kinematics = format!("--kinematics={}", file.display());
    let options = [&kinematics, "--firmware-name=mine 1.0#a1"];
    let mut rig = FakeRig::start(&[&options, more].concat());
    rig.fail("hand-rests on");
    (rig, kinematics)
}

#[test]
fn rotary_motors_are_probed_in_their_own_units() {
    let directory = tempfile::tempdir().expect("a directory");
    let (rig, _) = five_bar(&directory, &[]);
    let daemon = Daemon::start_on("fake", &[]);
    let answer = daemon.ctl_ok(&["devices", "--probe", &rig.address()]);
    assert!(
        answer.contains("motor 2 with 383.495 urad a count, up to 1 N m"),
        "{answer}"
    );
}

/// Homes it, and brings its hand into the workspace, where it lets go.
fn homed_and_let_go(rig: &mut FakeRig, daemon: &Daemon, client: &mut Client) {
    daemon.ctl_ok(&["home"]);
    assert_eq!(status(client).device.homed, Some(true));
    rig.fail("hand-rests off");
    wait_for(client, "the hand in the workspace", |status| {
        status
            .device_position_y_m
            .is_some_and(|y_m| (0.08..0.11).contains(&y_m))
    });
    rig.fail("hand-off on");
    let mut before = status(client);
    wait_for(client, "rest", |status| {
        if status.tick < before.tick + 100 {
            return false;
        }
        let place = |status: &Status| (status.device_position_m, status.device_position_y_m);
        let rests = place(status) == place(&before);
        before = status.clone();
        rests
    });
}

// hazard: H35
#[test]
fn five_bar_pulls_only_once_it_is_homed_and_commissioned() {
    timed(
        "a five-bar linkage, homed and commissioned",
        homed_commissioned_and_engaged,
    );
}

fn homed_commissioned_and_engaged() {
    let directory = tempfile::tempdir().expect("a directory");
    let (mut rig, kinematics) = five_bar(&directory, &[]);
    let (daemon, mut client) = idle_daemon(&rig, &[&kinematics]);
    let is_not_engaged = |client: &mut Client, why: &str| {
        let error = refused(client, Request::engage());
        assert!(error.message.contains(why), "{error}");
        error.code
    };
    is_not_engaged(&mut client, "the home pose of the rig is not known");
    homed_and_let_go(&mut rig, &daemon, &mut client);
    assert_eq!(is_not_engaged(&mut client, "motor 1"), ErrorCode::NotCommissioned);
    let mut other = daemon.client();
    lease(&mut other);
    let _: CommissionReply = other.request(Request::commission(Some(1))).expect("the rig is idle");
    daemon.ctl_refused(&["home"], 1, "cannot take the home pose");
    drop(other);
    wait_for(&mut client, "nobody who commissions", |status| {
        status.commissioning.is_none()
    });
    daemon.ctl_ok(&["commission", "--motor", "1", "--yes"]);
    is_not_engaged(&mut client, "motor 2");
    daemon.ctl_ok(&["commission", "--motor", "2", "--yes"]);
    // 0.3 kg and 0.1 N at the hand, in all directions; friction counts as at the motors.
    let advice: AdviceReply = client.request(Request::Advise {}).expect("advice");
    let basis = advice.basis.expect("what it is based on");
    assert_eq!(basis.friction_from, LossSource::Commissioned);
    assert!((0.01..0.12).contains(&basis.friction_n), "{basis:?}");
    assert!(basis.mass_kg.is_none_or(|kg| (0.02..0.4).contains(&kg)), "{basis:?}");
    for at in [basis.friction_at, basis.resolution_at] {
        let (x_m, y_m) = at.and_then(|at| at.x_m.zip(at.y_m)).expect("a place");
        assert!(x_m.abs() < 0.0601 && (0.0599..0.1301).contains(&y_m), "{basis:?}");
    }
    let shown = daemon.ctl_ok(&["advise"]);
    let at = basis.friction_at.expect("a place").to_string();
    assert!(shown.contains(&at), "{at}: {shown}");
    rig.fail("hand-off off");
    engage(&mut client);
    let (row, y) = rows_where(&daemon, "a force", |row, y| {
        row.command_force_n.hypot(y.command_force_n) > 2.0
    });
    assert!(row.command_force_n.hypot(y.command_force_n) < 13.4, "{row:?} {y:?}");
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
    drop(daemon);
    // Another connection, another home.
    let (_daemon, mut client) = idle_daemon(&rig, &[&kinematics]);
    assert_eq!(status(&mut client).device.homed, Some(false));
    is_not_engaged(&mut client, "home pose");
}

// hazard: H33
#[test]
fn wrong_wiring_of_two_motors_is_found_and_not_kept() {
    timed("a five-bar linkage that is wired wrongly", wired_wrongly);
}

fn wired_wrongly() {
    let wrong: [(&[&str], &str, &str); 2] = [
        (&["--reversed", "1"], "1", "wired the other way"),
        (
            &["--swapped", "--reversed"],
            "2",
            "the plugs of the encoders are swapped",
        ),
    ];
    for (wiring, motor, why) in wrong {
        let directory = tempfile::tempdir().expect("a directory");
        let (mut rig, kinematics) = five_bar(&directory, wiring);
        let (daemon, mut client) = idle_daemon(&rig, &[&kinematics]);
        if wiring[0] == "--swapped" {
            daemon.ctl_ok(&["home"]);
            let place = |status: &Status| (status.device_position_m, status.device_position_y_m.unwrap_or_default());
            let (home_x_m, home_y_m) = place(&status(&mut client));
            rig.fail("hand-rests off");
            wait_for(&mut client, "the hand away from home", |status| {
                let (x_m, y_m) = place(status);
                (x_m - home_x_m).hypot(y_m - home_y_m) > 1e-3
            });
        } else {
            homed_and_let_go(&mut rig, &daemon, &mut client);
        }
        daemon.ctl_refused(&["commission", "--motor", motor, "--yes"], 1, why);
        wait_for(&mut client, "no force", |_| rig.force().now_n == 0.0);
        assert_eq!(refused(&mut client, Request::engage()).code, ErrorCode::NotCommissioned);
    }
}

#[test]
fn pulse_is_not_given_where_the_hand_was_before_the_ramp() {
    timed("a hand that leaves the workspace while the rig engages", || {
        let directory = tempfile::tempdir().expect("a directory");
        let (mut rig, kinematics) = five_bar(&directory, &[]);
        let daemon = Daemon::start_strictly_on(&rig.address(), &[&kinematics, "--ramp-ms=1900"]);
        let mut client = daemon.client();
        wait_for_state(&mut client, RigState::Idle);
        homed_and_let_go(&mut rig, &daemon, &mut client);
        lease(&mut client);
        let _: CommissionReply = client.request(Request::commission(Some(1))).expect("the rig is idle");
        // It is taken home, which is outside.
        rig.fail("hand-rests on");
        rig.fail("hand-off off");
        let pulse = Request::CommissionPulse {
            force_n: 0.5,
            duration_ms: None,
        };
        let _: CommissionReply = client.request(pulse).expect("it is inside yet");
        let ended = until_some("the end", || {
            let status: CommissionReply = client.request(Request::CommissionStatus {}).expect("its own");
            status.ended
        });
        assert!(ended.contains("the hand is outside the workspace"), "{ended}");
        assert_eq!(rig.force().largest_n, 0.0);
    });
}
