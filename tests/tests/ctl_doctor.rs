//! `haptic-ctl doctor`: what is between a person and the rig.

use serde_json::Value;
use std::path::Path;
use std::process::Output;
use system_tests::{Daemon, ctl, text};

fn checks(output: &Output) -> Vec<Value> {
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    found["checks"].as_array().expect("checks").clone()
}

fn check<'a>(checks: &'a [Value], name: &str) -> &'a Value {
    checks
        .iter()
        .find(|check| check["check"] == name)
        .unwrap_or_else(|| panic!("{name} is missing: {checks:?}"))
}

#[test]
fn with_a_daemon_every_check_is_there_and_none_fails() {
    let daemon = Daemon::start(&[]);
    let output = daemon.ctl(&["doctor", "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let checks = checks(&output);
    for name in ["socket", "permission", "version", "rig"] {
        assert_eq!(check(&checks, name)["level"], "ok", "{checks:?}");
    }
    for name in ["real-time thread", "governor", "isolation"] {
        check(&checks, name);
    }
    for check in &checks {
        assert_eq!(
            check["fix"].is_string(),
            check["level"] == "warn" || check["level"] == "fail",
            "what is wrong can be mended: {check}"
        );
    }
    assert!(
        !daemon.ctl_ok(&["doctor"]).contains('\x1b'),
        "no colour where nobody sees it"
    );
    // A rig that is not ready is pointed out with what clears it.
    daemon.ctl_ok(&["stop"]);
    let checks = self::checks(&daemon.ctl(&["doctor", "--json"]));
    let rig = check(&checks, "rig");
    assert_eq!(
        (&rig["level"], &rig["fix"]),
        (&"warn".into(), &"`haptic-ctl reset`".into())
    );
}

#[test]
fn doctor_without_daemon_names_fix_and_checks_the_rest() {
    let output = ctl(Path::new("/nonexistent/control.sock"), &["doctor", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let found = checks(&output);
    let socket = check(&found, "socket");
    assert_eq!(socket["level"], "fail");
    for (field, part) in [("found", "/nonexistent/control.sock"), ("fix", "hapticd --demo")] {
        assert!(
            socket[field].as_str().is_some_and(|text| text.contains(part)),
            "{socket}"
        );
    }
    for name in ["priority limit", "memory limit", "governor"] {
        check(&found, name);
    }
    for name in ["isolation", "permission"] {
        assert_eq!(check(&found, name)["level"], "skip", "{found:?}");
    }

    let directory = tempfile::tempdir().expect("a directory");
    let dead = directory.path().join("control.sock");
    drop(std::os::unix::net::UnixListener::bind(&dead).expect("a socket"));
    let output = ctl(&dead, &["doctor"]);
    let printed = text(&output.stdout);
    assert!(
        printed.contains("fail  socket: ") && printed.contains("nobody listens"),
        "{printed}"
    );
}
