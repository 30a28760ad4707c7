//! A rig is commissioned by small pulses before it is engaged: the real programs, a fake rig with a
//! firmware of somebody's own behind a pseudo-terminal.

use haptic_ipc::{CommissionReply, ErrorCode, LeaseReply, Request, RigState};
use serde_json::Value;
use std::process::Command;
use system_tests::commissioning::{
    OWN, PUSH_N, after_the_pulse, begun, commission, daemon, daemon_at, pulse, refused, renders_the_scene,
};
use system_tests::fake_rig::FakeRig;
use system_tests::terminal::Terminal;
use system_tests::{Daemon, binary, engage, status, wait_for};

// hazard: H13
#[test]
fn a_rig_of_ones_own_engages_only_once_it_is_commissioned_and_as_long_as_it_is_the_same() {
    let directory = tempfile::tempdir().expect("a directory");
    let link = directory.path().join("rig");
    let mut rig = FakeRig::start_at(&link, &[&OWN[..], &["--stops-mm", "15"]].concat());
    let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);

    let output = daemon.ctl(&["engage"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    for part in [
        "mine 1.0",
        "never commissioned",
        "haptic-ctl commission",
        "--uncommissioned",
    ] {
        assert!(said.contains(part), "{said} lacks {part}");
    }
    assert_eq!(
        refused(&mut client, Request::Engage {}).code,
        ErrorCode::NotCommissioned
    );
    let problems = status(&mut client).device.engage_refused;
    assert!(
        problems
            .iter()
            .any(|problem| problem.remedy.contains("haptic-ctl commission")),
        "{problems:?}"
    );
    let doctor = daemon.ctl(&["doctor"]);
    let checked = String::from_utf8_lossy(&doctor.stdout).into_owned();
    assert!(checked.contains("fail  engage: "), "{checked}");

    // A handle that is not in the middle: the first pulses of its friction meet an end, which takes up their energy.
    let mut mover = begun(&daemon);
    for _ in 0..10 {
        let _: CommissionReply = mover.request(pulse(PUSH_N, 100.0)).expect("it is bounded");
        if after_the_pulse(&mut mover).position_m > 0.007 {
            break;
        }
    }
    drop(mover.request::<CommissionReply>(Request::CommissionEnd {}));
    drop(mover.request::<LeaseReply>(Request::Lease { timeout_ms: 0 }));
    let found = commission(daemon.socket(), &[]);
    println!("{found}");
    let number = |pointer: &str| found.pointer(pointer).and_then(Value::as_f64).expect(pointer);
    assert_eq!(found["sign"], 1);
    for direction in ["positive", "negative"] {
        let friction_n = number(&format!("/friction_N/{direction}"));
        assert!((friction_n - 0.8).abs() <= 0.1 * 0.8, "{friction_n} N");
        let breakaway_n = number(&format!("/breakaway_N/{direction}"));
        assert!((0.8..=0.8 * 1.5).contains(&breakaway_n), "{breakaway_n} N");
    }
    assert!((number("/range_m") - 0.03).abs() <= 0.05 * 0.03, "{found}");
    assert!((number("/step_m") - 1e-5).abs() < 1e-9, "{found}");
    let path = found["path"].as_str().expect("a path");
    let kept = std::fs::read_to_string(path).expect("it is kept");
    for part in ["mine 1.0", "resolution_m", "friction_N"] {
        assert!(kept.contains(part), "{kept} lacks {part}");
    }

    // At once, and after a restart.
    renders_the_scene(&daemon, &mut client);
    assert_eq!(status(&mut client).device.engage_refused, []);
    drop((daemon, client));
    let (daemon, mut client) = daemon_at(&rig, directory.path(), &[]);
    renders_the_scene(&daemon, &mut client);

    // Another rig behind the same path.
    for (other, why) in [
        (["--firmware-name", "mine 1.0", "--resolution-mm", "0.005"], "5.0000 um"),
        (["--firmware-name", "theirs 2", "--resolution-mm", "0.01"], "theirs 2"),
    ] {
        let before = status(&mut client)
            .device
            .link
            .map_or(0, |link| link.counts.connections);
        drop(rig);
        rig = FakeRig::start_at(&link, &other);
        wait_for(&mut client, "another connection", |status| {
            let link = status.device.link.as_ref().expect("a link");
            link.counts.connections > before && link.device.is_some() && status.state == RigState::Idle
        });
        let error = refused(&mut client, Request::Engage {});
        assert_eq!(error.code, ErrorCode::NotCommissioned, "{error}");
        assert!(error.message.contains(why), "{error} lacks {why}");
    }
    drop(rig);
}

// hazard: H13
#[test]
fn with_uncommissioned_in_the_configuration_any_rig_engages() {
    let rig = FakeRig::start(&OWN);
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("hapticd.toml");
    std::fs::write(&path, "uncommissioned = true\n").expect("written");
    let (_daemon, mut client) = daemon(&rig, &["--config", path.to_str().expect("a plain path")]);
    assert_eq!(status(&mut client).device.engage_refused, []);
    engage(&mut client);
}

// hazard: H13
#[test]
fn what_cannot_be_kept_is_told_and_the_rig_stays_uncommissioned() {
    let directory = tempfile::tempdir().expect("a directory");
    // A file stands where the directory should be: not even root can write there.
    let state = directory.path().join("state");
    std::fs::write(&state, "").expect("a file");
    let state = state.to_str().expect("a plain path");
    let arguments = ["--hand", "free", "--ramp-ms", "20", "--state-dir", state];
    let daemon = Daemon::start_at(&directory.path().join("control.sock"), &arguments);
    let mut client = begun(&daemon);
    for force_n in [PUSH_N, -PUSH_N] {
        let _: CommissionReply = client.request(pulse(force_n, 100.0)).expect("it is at rest");
        after_the_pulse(&mut client);
    }
    let error = refused(
        &mut client,
        Request::CommissionStore {
            range_m: None,
            friction_n: None,
        },
    );
    assert_eq!(error.code, ErrorCode::StateFile, "{error}");
    assert!(
        error.message.contains(state) && error.message.contains("--state-dir"),
        "{error}"
    );
}

// hazard: H8
#[test]
fn a_device_that_gives_no_force_is_not_engaged_whatever_is_allowed() {
    let rig = FakeRig::start(&["--force-limit-n", "0"]);
    let (daemon, mut client) = daemon(&rig, &["--uncommissioned", "--allow-no-watchdog"]);
    let error = refused(&mut client, Request::Engage {});
    assert_eq!((error.code, error.value), (ErrorCode::NoForce, Some(0.0)), "{error}");
    for part in ["force_limit = 0 N", "force_limit_mn"] {
        assert!(error.message.contains(part), "{error} lacks {part}");
    }
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("will not engage  force_limit = 0 N"), "{shown}");
    assert_eq!(status(&mut client).state, RigState::Idle);
}

// hazard: H9
#[test]
fn a_device_without_a_watchdog_or_with_a_long_one_engages_only_where_that_is_allowed() {
    for (watchdog_ms, told) in [("0", "watchdog_ms = 0 ms"), ("1000", "watchdog_ms = 1000 ms")] {
        let rig = FakeRig::start(&["--watchdog-ms", watchdog_ms]);
        let (_strict, mut client) = daemon(&rig, &[]);
        let error = refused(&mut client, Request::Engage {});
        assert_eq!((error.code, error.max), (ErrorCode::NoWatchdog, Some(200.0)), "{error}");
        for part in [told, "from 1 to 200 ms", "--allow-no-watchdog"] {
            assert!(error.message.contains(part), "{error} lacks {part}");
        }
        drop((_strict, client));
        let (_lenient, mut client) = daemon(&rig, &["--allow-no-watchdog"]);
        engage(&mut client);
    }
    let rig = FakeRig::start(&["--watchdog-ms", "200"]);
    let (_daemon, mut client) = daemon(&rig, &[]);
    engage(&mut client);
}

fn on_a_terminal(daemon: &Daemon, arguments: &[&str]) -> Terminal {
    let mut command = Command::new(binary("haptic-ctl"));
    command
        .args(["commission", "--socket"])
        .arg(daemon.socket())
        .args(arguments);
    Terminal::start(command)
}

#[test]
fn on_a_terminal_it_asks_before_each_step_and_nothing_is_kept_without_a_yes() {
    let start = || FakeRig::start(&[&OWN[..], &["--stops-mm", "5"]].concat());
    let rig = start();
    let (daemon, mut client) = daemon(&rig, &[]);
    let output = daemon.ctl(&["commission"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--yes"), "{said}");

    let mut terminal = on_a_terminal(&daemon, &[]);
    terminal.wait_for("the first question", |shown| shown.contains("1. Direction"));
    assert_eq!(status(&mut client).state, RigState::Idle, "nothing moves before a yes");
    assert!(status(&mut client).commissioning.is_some());
    terminal.type_in("\n");
    assert_eq!(terminal.end().code(), Some(130), "no is what is meant without a word");
    assert!(terminal.written().contains("Nothing is kept"), "{}", terminal.written());
    wait_for(&mut client, "the end of it", |status| status.commissioning.is_none());

    let mut terminal = on_a_terminal(&daemon, &["--range", "by-hand"]);
    for question in [
        "1. Direction",
        "2. Friction",
        "3. Range: the motor is off",
        "Keep this?",
    ] {
        let shown = terminal.wait_for(question, |shown| {
            shown.contains(question) || shown.contains("has ended")
        });
        assert!(shown.contains(question), "{shown}");
        terminal.type_in("y\n");
    }
    assert_eq!(terminal.end().code(), Some(0), "{}", terminal.written());
    let written = terminal.written();
    for part in ["is commissioned", "friction", "range", "encoder step", "kept in"] {
        assert!(written.contains(part), "{written} lacks {part}");
    }
    engage(&mut client);
}
