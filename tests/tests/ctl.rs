//! haptic-ctl as people and scripts use it.

use std::fs::Permissions;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::{Daemon, binary, copy_binary, ctl};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn every_subcommand_works_and_has_a_json_form() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    for (arguments, shown, json_field) in [
        (vec!["status"], "idle", "state"),
        (vec!["describe"], "velocity_threshold", "parameters"),
        (vec!["describe", "lugre"], "law lugre: ", "parameters"),
        (vec!["describe", "dahl"], "law dahl: ", "parameters"),
        (vec!["get"], "simulated friction", "params"),
        (
            vec!["set", "mass=1.5", "Fs=5", "Fd=3.5", "b=2", "DV=0.002"],
            "mass = 1.5 kg",
            "revision",
        ),
        (vec!["set", "Fs+=5", "Fs-=3"], "static_force- = 3 N", "advice"),
        (vec!["undo"], "revision", "changes"),
        (vec!["redo"], "revision", "changes"),
        (vec!["scene", "list"], "viscous-drag", "scenes"),
        (vec!["scene", "show"], "law = ", "friction"),
        (vec!["scene", "diff", "lugre"], "law: lugre -> karnopp", "differences"),
        (vec!["scene", "save", "mine", "--replace"], "mine is in", "path"),
        (vec!["scene", "load", "mine"], "nothing differs", "applied"),
        (vec!["log"], "scene.save", "seq"),
        (vec!["devices"], "", "devices"),
        (vec!["doctor"], "socket", "checks"),
        (vec!["wait", "--until", "state=idle"], "idle", "waited_s"),
        (vec!["engage"], "eng", "tick"),
        (vec!["release"], "at tick", "tick"),
        (vec!["stop"], "stopped", "tick"),
        (vec!["reset"], "idle", "tick"),
        (vec!["timing"], "overruns", "wake_latency_ns"),
        (vec!["advise"], "linear_stability", "advice"),
        (
            vec!["log", "--follow", "samples", "--count", "2", "--rate", "100"],
            "device mm",
            "device_position_m",
        ),
    ] {
        let people = daemon.ctl_ok(&arguments);
        assert!(people.contains(shown), "{arguments:?}: {people}");
        let scripts = daemon.ctl_ok(&[arguments.clone(), vec!["--json"]].concat());
        for line in scripts.lines() {
            let value: serde_json::Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"));
            assert!(!value[json_field].is_null(), "{arguments:?}: {line} lacks {json_field}");
        }
        assert!(!scripts.is_empty());
    }
}

/// Names that scripts may rely on. What is not listed here may be absent.
#[test]
fn the_names_in_json_stay() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("r.csv").display().to_string();
    for (arguments, names) in [
        (
            vec!["status"],
            "server state tick uptime_s rate_hz scheme velocity_estimator revision scene command_force_N energy_excess_J device_position_m clients device real_time",
        ),
        (vec!["describe"], "law parameters sample_columns"),
        (vec!["get"], "revision params scene"),
        (vec!["set", "mass=1"], "revision tick applied changes advice"),
        (vec!["undo"], "revision tick applied changes advice"),
        (vec!["redo"], "revision tick applied changes advice"),
        (vec!["scene", "list"], "scenes"),
        (vec!["scene", "load", "lugre"], "revision tick applied changes advice"),
        (vec!["scene", "save", "mine"], "name path"),
        (vec!["scene", "diff", "lugre"], "differences"),
        (vec!["scene", "show"], "name block coupling friction"),
        (vec!["log", "-n", "1"], "event seq time_unix_s by op revision"),
        (vec!["engage"], "state tick"),
        (vec!["release"], "state tick"),
        (vec!["stop"], "state tick"),
        (vec!["reset"], "state tick"),
        (
            vec!["wait", "--until", "state=idle"],
            "condition state revision tick waited_s",
        ),
        (
            vec!["log", "--follow", "samples", "--count", "1"],
            "event dropped tick t_s state contact device_position_m device_velocity_mps block_position_m block_velocity_mps coupling_force_N command_force_N revision wake_latency_ns tick_ns device_round_trip_ns",
        ),
        (
            vec!["log", "--follow", "state", "--count", "1"],
            "event state tick revision scene law params",
        ),
        (vec!["record", &file, "--for", "20ms"], "file rows lost bytes length_s"),
        (
            vec!["timing"],
            "rate_hz ticks overruns missed_periods telemetry_dropped wake_latency_ns tick_ns device_round_trip_ns period_ns histogram last_10_s",
        ),
        (vec!["advise"], "revision advice"),
        (vec!["devices"], "devices"),
        (vec!["doctor"], "checks failed"),
    ] {
        let said = daemon.ctl_ok(&[arguments.clone(), vec!["--json"]].concat());
        let value: serde_json::Value = serde_json::from_str(&said).unwrap_or_else(|error| panic!("{said}: {error}"));
        for name in names.split(' ') {
            assert!(!value[name].is_null(), "{arguments:?}: {name} is missing from {said}");
        }
    }
    let output = ctl(Path::new("/nonexistent/control.sock"), &["status", "--json"]);
    let error: serde_json::Value = serde_json::from_slice(&output.stderr).expect("errors have a JSON form too");
    assert_eq!(error["error"]["code"], "no_daemon");
    assert!(output.stdout.is_empty());
}

#[test]
fn exit_codes_tell_what_went_wrong() {
    let daemon = Daemon::start(&[]);
    for (arguments, code, named) in [
        (vec!["set", "mass=-1"], 1, "0.000001 to 100 kg"),
        (vec!["set", "masss=1"], 1, "did you mean `mass`"),
        (
            vec!["log", "--follow", "samples", "--rate", "9999"],
            1,
            "--rate = 9999 Hz is out of range: it must be from 0.1 to 1000 Hz",
        ),
        (vec!["set", "mass"], 2, "NAME=VALUE"),
        (vec!["set", "mass=NaN"], 2, "not a finite number"),
        (vec!["set"], 2, "NAME=VALUE"),
        (vec!["fly"], 2, "fly"),
        (vec!["stauts"], 2, "'status'"),
        (vec!["watch"], 2, "'log'"),
        (vec!["engage", "--force"], 2, "'--anyway'"),
        (vec!["scene", "save", "mine", "--force"], 2, "'--replace'"),
        (vec!["wait", "--until", "engaged"], 2, "write state=engaged"),
        (vec!["scene", "lod"], 2, "'load'"),
    ] {
        let output = daemon.ctl(&arguments);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
        assert!(
            text(&output.stderr).contains(named),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
    }
    assert_eq!(daemon.ctl(&["stop"]).status.code(), Some(0));
    let output = daemon.ctl(&["engage"]);
    assert_eq!(output.status.code(), Some(6), "{}", text(&output.stderr));
    let output = daemon.ctl(&["set", "mass=-1", "--json"]);
    let error: serde_json::Value = serde_json::from_slice(&output.stderr).expect("errors have a JSON form too");
    assert_eq!(error["error"]["param"], "mass");

    let nobody = ctl(Path::new("/nonexistent/control.sock"), &["status"]);
    assert_eq!(nobody.status.code(), Some(3));
    assert!(
        text(&nobody.stderr).contains("/nonexistent/control.sock"),
        "{}",
        text(&nobody.stderr)
    );
    assert!(
        text(&nobody.stderr).contains("hapticd --demo"),
        "{}",
        text(&nobody.stderr)
    );
}

#[test]
fn foreign_socket_denies_permission_and_doctor_names_owner() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let daemon = Daemon::start_at(&socket, &[]);
    let closed = |mode| std::fs::set_permissions(directory.path().join("run"), Permissions::from_mode(mode));
    // The binary may lie where only root can go, and root may go everywhere.
    let copy = directory.path().join("haptic-ctl");
    copy_binary("haptic-ctl", &copy);
    std::fs::set_permissions(directory.path(), Permissions::from_mode(0o755)).expect("ours");
    closed(if rustix::process::geteuid().is_root() {
        0o700
    } else {
        0o000
    })
    .expect("ours");
    let other = |subcommand: &str| {
        let mut command = Command::new(&copy);
        command.arg(subcommand).arg("--socket").arg(&socket);
        if rustix::process::geteuid().is_root() {
            const NOBODY: u32 = 65534;
            command.uid(NOBODY).gid(NOBODY);
        }
        command.output().expect("haptic-ctl starts")
    };
    let (status, doctor) = (other("status"), other("doctor"));
    closed(0o700).expect("ours");
    assert_eq!(status.status.code(), Some(4), "{}", text(&status.stderr));
    assert!(
        text(&status.stderr).contains("no permission to use"),
        "{}",
        text(&status.stderr)
    );
    assert_eq!(doctor.status.code(), Some(1));
    let said = text(&doctor.stdout);
    assert!(
        said.contains("fail  socket: no permission") && said.contains("fail  permission: "),
        "{said}"
    );
    // An owner who has closed their own directory is shown which.
    let fix = if rustix::process::geteuid().is_root() {
        "sudo -u 'root' haptic-ctl --socket '"
    } else {
        "namei -l '"
    };
    assert!(said.contains(fix), "{said}");
    drop(daemon);
}

#[test]
fn devices_are_listed_without_a_daemon() {
    let nowhere = Path::new("/nonexistent/control.sock");
    let listed = ctl(nowhere, &["devices", "--json"]);
    assert!(listed.status.success(), "{}", text(&listed.stderr));
    let listed: haptic_ipc::DevicesReply = serde_json::from_slice(&listed.stdout).expect("a list");
    let people = ctl(nowhere, &["devices"]);
    for device in &listed.devices {
        assert!(text(&people.stdout).contains(&device.address), "{people:?}");
    }
    // Only a daemon opens one.
    let probed = ctl(nowhere, &["devices", "--probe", "serial:/dev/ttyACM0"]);
    assert_eq!(probed.status.code(), Some(3), "{probed:?}");
}

#[test]
fn a_stop_that_nobody_confirms_is_no_success() {
    // A daemon that greets and then says nothing.
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("mute.sock");
    let listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
    let mute = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a client");
        std::io::Write::write_all(
            &mut stream,
            b"{\"hello\":{\"protocol\":1,\"server\":\"mute\",\"session\":\"1\"}}\n",
        )
        .expect("it reads");
        // Until the client gives up.
        drop(std::io::Read::read_to_end(&mut stream, &mut Vec::new()));
    });
    let output = ctl(&socket, &["stop"]);
    assert_eq!(output.status.code(), Some(5), "{}", text(&output.stderr));
    mute.join().expect("it ends");
}

#[test]
fn interrupted_events_exit_130_and_closed_pipe_ends_quietly() {
    let daemon = Daemon::start(&[]);
    let mut events = Command::new(binary("haptic-ctl"))
        .arg("--socket")
        .arg(daemon.socket())
        .args(["log", "--follow", "samples", "--rate", "all", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("haptic-ctl starts");
    let mut lines = BufReader::new(events.stdout.take().expect("it is piped")).lines();
    let mut last = None;
    for _ in 0..500 {
        let line = lines.next().expect("another sample").expect("text");
        let sample: serde_json::Value = serde_json::from_str(&line).expect("an object a line");
        let tick = sample["tick"].as_u64().expect("a tick");
        assert!(last.is_none_or(|last| tick == last + 1), "{tick} after {last:?}");
        last = Some(tick);
    }
    let pid = rustix::process::Pid::from_child(&events);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
    assert!(lines.by_ref().all(|line| line.is_ok()));
    assert_eq!(events.wait().expect("it ends").code(), Some(130));

    let mut events = Command::new(binary("haptic-ctl"))
        .arg("--socket")
        .arg(daemon.socket())
        .args(["log", "--follow", "samples", "--rate", "all"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("haptic-ctl starts");
    let mut reader = BufReader::new(events.stdout.take().expect("it is piped"));
    reader.read_line(&mut String::new()).expect("a header");
    drop(reader);
    let output = events.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
}

#[test]
fn a_scene_is_simulated_along_a_motion_without_a_daemon() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| directory.path().join(name).to_str().expect("a plain path").to_owned();
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let scene = format!("{root}/scenes/simulated-friction.toml");
    let motion = format!("{root}/crates/haptic-core/tests/data/reference/paper.csv");
    let (out, events) = (path("out.csv"), path("events.csv"));
    let simulate = |more: &[&str]| {
        let basic = [
            "simulate", &scene, "--motion", &motion, "--out", &out, "--events", &events, "--force",
        ];
        let output = ctl(Path::new("/nonexistent/control.sock"), &[&basic, more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        (text(&output.stdout), std::fs::read_to_string(&out).expect("rows"))
    };
    let (summary, rows) = simulate(&[]);
    assert!(summary.contains("3000 ticks") && summary.contains("0 J"), "{summary}");
    assert_eq!(
        rows.lines().next(),
        std::fs::read_to_string(&motion).expect("the motion").lines().next()
    );
    assert_eq!(rows.lines().count(), 3002);
    assert_eq!(simulate(&[]).1, rows, "two runs are the same");
    assert_eq!(std::fs::read_to_string(&events).expect("events").lines().count(), 24);
    let (summary, literal) = simulate(&["--scheme", "literal:10", "--block-velocity", "-0.1", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["scheme"], "literal:10");
    assert!(
        summary["energy_created_J"].as_f64().is_some_and(|energy| energy > 0.0),
        "{summary}"
    );
    assert_ne!(literal, rows);
    assert!(
        literal.lines().nth(1).is_some_and(|row| row.ends_with(",-1")),
        "a block that moves begins sliding"
    );

    let output = ctl(
        Path::new("/"),
        &["simulate", &scene, "--motion", &scene, "--out", &out, "--force"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("no heading with rows of numbers"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn wrong_usage_has_a_json_form_too() {
    let daemon = Daemon::start(&[]);
    for (arguments, named) in [
        (vec!["fly", "--json"], "fly"),
        (vec!["--json", "set"], "NAME=VALUE"),
        (vec!["set", "--json", "mass"], "NAME=VALUE"),
        (vec!["set", "K=25,000", "--json"], "decimal point"),
        (vec!["wait", "--until", "mas=1", "--json"], "did you mean `mass`?"),
        (
            vec!["set", "mass=1", "--ramp", "-50ms", "--json"],
            "`-50ms` is negative",
        ),
        (
            vec!["record", "x.mcap", "--format", "csv", "--json"],
            "--format is for `-`",
        ),
        (vec!["scene", "--json"], "subcommand"),
    ] {
        let output = daemon.ctl(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = text(&output.stderr);
        let error: serde_json::Value = serde_json::from_str(&said).unwrap_or_else(|error| panic!("{said}: {error}"));
        assert_eq!(error["error"]["code"], "usage");
        let message = error["error"]["message"].as_str().unwrap_or_default();
        assert!(
            message.contains(named) && !message.contains("Usage:"),
            "{arguments:?}: {message}"
        );
    }
    let output = daemon.ctl(&["lease", "--what", "--", "true", "--json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).starts_with("error: "),
        "what stands after -- is another's"
    );
    let help = daemon.ctl_ok(&["set", "--help", "--json"]);
    assert!(help.contains("NAME=VALUE"), "help is no error: {help}");
}

#[test]
fn every_code_and_exit_code_of_its_own_is_documented() {
    let page = include_str!("../../docs/reference/exit-codes.md");
    let help = text(&ctl(Path::new("/nonexistent"), &["--help"]).stdout).replace('\n', " ");
    for code in
        "usage no_daemon no_permission no_answer timed_out halted other_version bad_answer bad_rig bad_recording \
         not_comparable no_device cannot_write"
            .split_whitespace()
    {
        assert!(page.contains(&format!("| `{code}` |")), "{code}");
        assert!(help.contains(code), "{code} is missing from {help}");
    }
}

#[test]
fn whoever_may_only_watch_is_told_so_and_ends_with_4() {
    let directory = tempfile::tempdir().expect("a directory");
    let watch = directory.path().join("watch/watch.sock");
    let _daemon = Daemon::start(&["--watch-socket", watch.to_str().expect("text")]);
    let output = ctl(&watch, &["set", "mass=1"]);
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    let doctor = text(&ctl(&watch, &["doctor"]).stdout);
    assert!(doctor.contains("the watchers' socket"), "{doctor}");
}

#[test]
fn a_refusal_names_the_option_and_not_the_field() {
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["scene", "save", "mine"]);
    for (arguments, named) in [
        (vec!["set", "mass=1", "--ramp", "20s"], "--ramp = 20000 ms"),
        (vec!["set", "mass=1", "--if-revision", "7"], "--if-revision = 7"),
        (vec!["scene", "save", "mine"], "`--replace`"),
        (vec!["get", "min"], "did you mean `mine`?"),
    ] {
        let output = daemon.ctl(&arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(
            text(&output.stderr).contains(named),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
    }
    assert_eq!(daemon.ctl_ok(&["log", "-n", "0"]), "", "none were asked for");
    let far = daemon.raw().ask(r#"{"id":1,"op":"set","params":{},"ramp_ms":1e308}"#);
    assert!(
        far["error"]["message"].as_str().is_some_and(|said| said.len() < 100),
        "{far}"
    );
}
