//! haptic-ctl as people and scripts use it: every subcommand, its names in JSON, its refusals and their exit codes.

use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use system_tests::{Daemon, ctl_offline, ctl_offline_json, ctl_offline_refused, is_refused, process, stderr, text};

/// Each with what it shows to people, and the names in JSON that scripts may rely on. What is not listed here may be
/// absent.
#[test]
fn every_subcommand_works_and_its_names_in_json_stay() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("r.csv").display().to_string();
    let change = "revision tick applied changes advice";
    for (line, shown, names) in [
        (
            "status",
            "idle",
            "server state tick uptime_s rate_hz scheme velocity_estimator revision scene command_force_N energy_excess_J \
             device_position_m clients device real_time",
        ),
        ("describe", "velocity_threshold", "law parameters sample_columns"),
        ("describe lugre", "law lugre: ", "parameters"),
        ("get", "simulated friction", "revision params scene"),
        ("set mass=1.5 Fs=5 Fd=3.5 b=2 DV=0.002", "mass = 1.5 kg", "revision"),
        ("set Fs+=5 Fs-=3", "static_force- = 3 N", "advice"),
        ("undo", "revision", change),
        ("redo", "revision", change),
        ("scene list", "viscous-drag", "scenes"),
        ("scene show", "law = ", "name block coupling friction"),
        ("scene diff lugre", "law: lugre -> karnopp", "differences"),
        ("scene save mine --replace", "mine is in", "name path"),
        ("log -n 1", "scene.save", "event seq time_unix_s by op revision"),
        ("scene load mine", "-> mine", "revision applied changes advice"),
        ("devices", "", "devices"),
        ("doctor", "socket", "checks failed"),
        (
            "wait --until state=idle",
            "idle",
            "condition state revision tick waited_s",
        ),
        ("engage", "eng", "state tick"),
        ("release", "at tick", "state tick"),
        ("stop", "stopped", "state tick"),
        ("reset", "idle", "state tick"),
        (
            "timing",
            "overruns",
            "rate_hz ticks overruns missed_periods telemetry_dropped wake_latency_ns tick_ns device_round_trip_ns \
             period_ns histogram last_10_s",
        ),
        ("advise", "linear_stability", "revision advice"),
        (
            "log --follow samples --count 2 --rate 100",
            "device mm",
            "event dropped tick t_s state contact device_position_m device_velocity_mps block_position_m \
             block_velocity_mps coupling_force_N command_force_N revision wake_latency_ns tick_ns device_round_trip_ns",
        ),
        (
            "log --follow state --count 1",
            "idle",
            "event state tick revision scene law params",
        ),
        (
            "record FILE --force --for 20ms",
            "rows",
            "file rows lost bytes length_s",
        ),
    ] {
        let arguments: Vec<&str> = line
            .split(' ')
            .map(|word| if word == "FILE" { &file } else { word })
            .collect();
        let people = daemon.ctl_ok(&arguments);
        assert!(people.contains(shown), "{line}: {people}");
        let scripts = daemon.ctl_ok(&[&arguments[..], &["--json"]].concat());
        assert!(!scripts.is_empty());
        for answer in scripts.lines() {
            let value: Value = serde_json::from_str(answer).unwrap_or_else(|error| panic!("{answer}: {error}"));
            for name in names.split_whitespace() {
                assert!(!value[name].is_null(), "{line}: {name} is missing from {answer}");
            }
        }
    }
}

/// A wrong line is refused with the exit code of its kind, and under `--json` as an error of its code.
#[test]
fn refusals_name_what_was_typed_and_what_was_meant() {
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["scene", "save", "mine"]);
    for (line, code, named) in [
        ("set mass=-1", 1, "0.000001 to 100 kg"),
        ("set masss=1", 1, "did you mean `mass`"),
        ("set mass=1 --ramp 20s", 1, "--ramp = 20000 ms"),
        ("set mass=1 --if-revision 7", 1, "--if-revision = 7"),
        ("get min", 1, "did you mean `mine`?"),
        ("scene save mine", 1, "`--replace`"),
        ("scene load viscus-drag", 1, "did you mean `viscous-drag`"),
        ("scene load @99", 1, "revision 99 is unknown"),
        (
            "log --follow samples --rate 9999",
            1,
            "--rate = 9999 Hz is out of range: it must be from 0.1 to 1000 Hz",
        ),
        ("scene load missing.toml", 2, "missing.toml"),
        ("set", 2, "NAME=VALUE"),
        ("set mass", 2, "NAME=VALUE"),
        ("set mass=5N", 2, "mass is in kg, g or mg"),
        ("set mass=1 --ramp 50", 2, "50ms"),
        ("fly", 2, "fly"),
        ("stauts", 2, "'status'"),
        ("load mine", 2, "'scene load'"),
        ("scene", 2, "subcommand"),
        ("log --rate all", 2, "--follow"),
        ("wait --until engaged", 2, "write state=engaged"),
        ("record x.mcap --format csv", 2, "--format is for `-`"),
        ("record nothing.mcap --for 0s", 2, "--for = 0 s"),
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = daemon.ctl(&arguments);
        is_refused(line, &output, code, &[named]);
        assert!(output.stdout.is_empty(), "{line}: {}", text(&output.stdout));
        let output = daemon.ctl(&[&arguments[..], &["--json"]].concat());
        let printed = is_refused(line, &output, code, &[]);
        let error: Value = serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{line}: {printed}: {error}"));
        let message = error["error"]["message"].as_str().unwrap_or_default();
        // A refusal of the daemon keeps the words of the protocol there.
        assert!(message.contains(named) || code == 1, "{line}: {message}");
        assert!(!message.is_empty() && !message.contains("Usage:"), "{line}: {message}");
        assert_eq!(error["error"]["code"] == "usage", code == 2, "{line}: {error}");
    }
    // What stands after -- is another's, and help is no error.
    let printed = daemon.ctl_refused(&["lease", "--what", "--", "true", "--json"], 2, "error: ");
    assert!(printed.starts_with("error: "), "{printed}");
    assert!(daemon.ctl_ok(&["set", "--help", "--json"]).contains("NAME=VALUE"));
    daemon.ctl_ok(&["stop"]);
    daemon.ctl_refused(&["engage"], 6, "");
    let nobody = ["/nonexistent", "hapticd --demo"];
    ctl_offline_refused(&["status"], 3, &nobody);
    let printed = ctl_offline_refused(&["status", "--json"], 3, &nobody);
    let error: Value = serde_json::from_str(&printed).expect("errors have a JSON form too");
    assert_eq!(error["error"]["code"], "no_daemon");
}

#[test]
fn devices_are_listed_without_a_daemon() {
    let listed: haptic_ipc::DevicesReply =
        serde_json::from_value(ctl_offline_json(&["devices"])).expect("a list of devices");
    let people = text(&ctl_offline(&["devices"]).stdout);
    for device in &listed.devices {
        assert!(people.contains(&device.address), "{people}");
    }
    // Only a daemon opens one.
    ctl_offline_refused(&["devices", "--probe", "serial:/dev/ttyACM0"], 3, &[]);
}

#[test]
fn interrupted_events_exit_130_and_closed_pipe_ends_quietly() {
    let daemon = Daemon::start(&[]);
    let follow = ["log", "--follow", "samples", "--rate", "all", "--json"];
    let mut events = daemon.start_ctl(&follow);
    let mut lines = BufReader::new(events.stdout.take().expect("it is piped")).lines();
    let mut last = None;
    for _ in 0..500 {
        let line = lines.next().expect("another sample").expect("text");
        let sample: Value = serde_json::from_str(&line).expect("an object a line");
        let tick = sample["tick"].as_u64().expect("a tick");
        assert!(last.is_none_or(|last| tick == last + 1), "{tick} after {last:?}");
        last = Some(tick);
    }
    process::signal(events.id(), Signal::INT);
    assert!(lines.by_ref().all(|line| line.is_ok()));
    assert_eq!(events.wait().expect("it ends").code(), Some(130));

    for arguments in [&follow[..5], &["record", "-"]] {
        let mut program = daemon.start_ctl(arguments);
        let mut reader = BufReader::new(program.stdout.take().expect("it is piped"));
        reader.read_line(&mut String::new()).expect("its beginning");
        drop(reader);
        let output = program.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    }
}

#[test]
fn every_code_and_exit_code_of_its_own_is_documented() {
    let page = include_str!("../../docs/reference/exit-codes.md");
    let help = text(&ctl_offline(&["--help"]).stdout).replace('\n', " ");
    for code in
        "usage no_daemon no_permission no_answer timed_out halted other_version bad_answer bad_rig bad_recording \
         not_comparable no_device cannot_write"
            .split_whitespace()
    {
        assert!(page.contains(&format!("| `{code}` |")), "{code}");
        assert!(help.contains(code), "{code} is missing from {help}");
    }
}
