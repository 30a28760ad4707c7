//! What haptic-ctl prints, and no more: `--quiet`, and what is followed.

use serde_json::Value;
use system_tests::{Daemon, stderr, text};

#[test]
fn quiet_leaves_what_was_asked_for_and_errors() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    for done in [
        "set mass=2 -q",
        "--quiet set K=250N/mm",
        "undo -q",
        "redo -q",
        "scene load lugre -q",
        "scene save mine -q",
        "scene rename mine ours -q",
        "scene delete ours -q",
        "engage --wait -q",
        "release --wait -q",
        "stop -q",
        "reset -q",
        "schedule cancel -q",
    ] {
        let words: Vec<&str> = done.split(' ').collect();
        let output = daemon.ctl(&words);
        assert!(output.status.success(), "{done}: {}", stderr(&output));
        let printed = text(&output.stdout) + &stderr(&output);
        assert_eq!(printed, "", "{done}");
    }
    assert_eq!(daemon.ctl_ok(&["get", "mass", "-q"]), "0.5 kg\n");
    let tried = daemon.ctl_ok(&["set", "Fs=5", "--dry-run", "-q"]);
    assert!(tried.contains("only tried"), "{tried}");
    let samples = daemon.ctl_ok(&["log", "--follow", "samples", "--count", "1", "-q"]);
    assert!(
        samples.lines().count() == 1 && samples.contains("idle"),
        "no heading: {samples}"
    );
    daemon.ctl_refused(&["set", "mass=-1", "-q"], 1, "out of range");
}

#[test]
fn log_follows_states_entries_samples_and_timing() {
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["set", "mass=1.5"]);
    daemon.ctl_ok(&["stop"]);
    let printed = daemon.ctl_ok(&["log", "-n", "5", "--follow", "--count", "3"]);
    for part in [
        "set  tick",
        "mass: 0.5 kg -> 1.5 kg",
        "stop  idle -> stopped",
        "state  stopped  tick ",
    ] {
        assert!(printed.contains(part), "{part} is missing: {printed}");
    }
    let all = [
        "log", "-f", "state", "log", "samples", "timing", "-n", "1", "--rate", "0.1kHz", "--count", "200", "--json",
    ];
    let lines: Vec<Value> = daemon
        .ctl_ok(&all)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}")))
        .collect();
    assert_eq!(lines.len(), 200);
    for kind in ["state", "log", "samples", "timing"] {
        assert!(lines.iter().any(|line| line["event"] == kind), "no {kind}");
    }
    let samples = lines.iter().filter(|line| line["event"] == "samples");
    samples.for_each(|sample| assert!(sample["tick"].is_u64() && sample["dropped"] == 0, "{sample}"));
}
