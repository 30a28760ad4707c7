//! `haptic-ctl doctor`: what is between a person and the rig.

use serde_json::Value;
use std::process::Output;
use system_tests::Daemon;

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
