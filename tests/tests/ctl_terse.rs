//! What haptic-ctl prints, and no more: advice, `--quiet`, what is followed, and which scene was meant.

use serde_json::Value;
use system_tests::{Daemon, stderr, text};

fn parsed(line: &str) -> Value {
    serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"))
}

#[test]
fn set_prints_the_advice_on_the_scene() {
    let daemon = Daemon::start(&[]);
    let stiff = |printed: &str| {
        let mut notes = printed.lines().filter_map(|line| line.strip_prefix("note: "));
        notes.any(|note| note.contains("against a stuck block the loop oscillates"))
    };
    let printed = daemon.ctl_ok(&["set", "K=200N/mm"]);
    assert!(stiff(&printed), "{printed}");
    // It still holds, whatever else is changed.
    assert!(stiff(&daemon.ctl_ok(&["set", "Fs=5"])));
    assert!(!stiff(&daemon.ctl_ok(&["set", "K=1N/mm"])));
    assert!(stiff(&daemon.ctl_ok(&["undo"])));
}

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
        assert_eq!(
            (text(&output.stdout), stderr(&output)),
            (String::new(), String::new()),
            "{done}"
        );
    }
    assert_eq!(daemon.ctl_ok(&["get", "mass", "-q"]), "0.5 kg\n");
    assert!(daemon.ctl_ok(&["status", "-q"]).contains("idle"));
    assert!(
        daemon
            .ctl_ok(&["set", "Fs=5", "--dry-run", "-q"])
            .contains("only tried")
    );
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
    let lines: Vec<Value> = daemon.ctl_ok(&all).lines().map(parsed).collect();
    assert_eq!(lines.len(), 200);
    for kind in ["state", "log", "samples", "timing"] {
        assert!(lines.iter().any(|line| line["event"] == kind), "no {kind}");
    }
    let samples = lines.iter().filter(|line| line["event"] == "samples");
    assert!(
        samples
            .clone()
            .all(|sample| sample["tick"].is_u64() && sample["dropped"] == 0)
    );
}
