//! `haptic-ctl doctor`: what is between a person and the rig.

use serde_json::Value;
use system_tests::Daemon;

/// Every check, by its name.
fn checks(daemon: &Daemon) -> impl Fn(&str) -> Value {
    let found = daemon.ctl_json(&["doctor"]);
    let checks = found["checks"].as_array().expect("checks").clone();
    for check in &checks {
        let is_wrong = check["level"] == "warn" || check["level"] == "fail";
        assert_eq!(
            check["fix"].is_string(),
            is_wrong,
            "what is wrong can be mended: {check}"
        );
    }
    move |name| {
        let found = checks.iter().find(|check| check["check"] == name);
        found.unwrap_or_else(|| panic!("{name} is missing: {checks:?}")).clone()
    }
}

#[test]
fn with_a_daemon_every_check_is_there_and_none_fails() {
    let daemon = Daemon::start(&[]);
    let check = checks(&daemon);
    for name in ["socket", "permission", "version", "rig"] {
        assert_eq!(check(name)["level"], "ok", "{name}");
    }
    for name in ["real-time thread", "governor", "isolation"] {
        check(name);
    }
    let printed = daemon.ctl_ok(&["doctor"]);
    assert!(!printed.contains('\x1b'), "no colour where nobody sees it");
    // A rig that is not ready is pointed out with what clears it.
    daemon.ctl_ok(&["stop"]);
    let rig = checks(&daemon)("rig");
    assert_eq!(
        (&rig["level"], &rig["fix"]),
        (&"warn".into(), &"`haptic-ctl reset`".into())
    );
}
