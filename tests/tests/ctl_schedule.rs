//! Changes in ticks to come, relative changes, the value of one parameter, and the library's files, from the command
//! line.

use serde_json::Value;
use system_tests::{Daemon, status};

fn refused(daemon: &Daemon, arguments: &[&str], code: i32) -> String {
    let output = daemon.ctl(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

fn json(said: &str) -> Vec<Value> {
    said.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}")))
        .collect()
}

#[test]
fn schedule_file_is_awaited_and_kept_one_cancelled_by_name() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("steps.json");
    let file = file.to_str().expect("a plain path");
    let write = |first: u64| {
        let text = format!(
            r#"[{{"at_tick":{first},"params":{{"Fs":{{"plus":0.5}}}}}},{{"at_tick":{},"scene":"viscous-drag"}}]"#,
            first + 7
        );
        std::fs::write(file, text).expect("it can be written");
    };
    let mut client = daemon.client();
    // No machine is slower to start haptic-ctl.
    let first = status(&mut client).tick + 3000;
    write(first);
    let said = json(&daemon.ctl_ok(&["schedule", file, "--json"]));
    let rendered: Vec<(&Value, &Value)> = said[1..].iter().map(|entry| (&entry["tick"], &entry["op"])).collect();
    assert_eq!(
        rendered,
        [
            (&Value::from(first), &Value::from("set")),
            (&Value::from(first + 7), &Value::from("scene.load"))
        ]
    );
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("viscous-drag of the library"), "{shown}");

    daemon.ctl_ok(&["scene", "load", "simulated-friction"]);
    write(first + 1_000_000);
    daemon.ctl_ok(&["schedule", file, "--keep", "--name", "later"]);
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("2 changes (later) from tick"), "{shown}");
    let said = refused(&daemon, &["set", "b=9"], 1);
    assert!(said.contains("schedule.cancel"), "{said}");
    let said = daemon.ctl_ok(&["schedule", "cancel", "later"]);
    assert!(said.starts_with("2 scheduled changes were cancelled"), "{said}");
    refused(&daemon, &["schedule", "cancel", "later"], 1);
    let said = refused(&daemon, &["set", "b=9", "--at-tick", "1"], 1);
    assert!(said.contains("at_tick = 1 is out of range"), "{said}");
}

#[test]
fn set_scales_and_adds_and_scenes_are_renamed_and_deleted() {
    let daemon = Daemon::start(&[]);
    let said = daemon.ctl_ok(&["set", "mass*=3", "Fs+*=2", "--json"]);
    let applied = &json(&said)[0]["applied"];
    assert_eq!(
        (&applied["mass"], &applied["static_force+"]),
        (&1.5.into(), &8.0.into())
    );
    let said = daemon.ctl_ok(&["set", "--by", "Fs-=500mN", "--json"]);
    assert_eq!(json(&said)[0]["applied"]["static_force-"], 4.5);
    for (name, value) in [("mass", "1.5 kg"), ("Fs", "+8 -4.5 N"), ("Fs-", "4.5 N")] {
        assert_eq!(daemon.ctl_ok(&["get", name]).trim_end(), value);
    }
    let one = json(&daemon.ctl_ok(&["get", "Fs+", "--json"]));
    assert_eq!(
        one[0],
        serde_json::json!({"param":"static_force+","value":8.0,"unit":"N"})
    );
    let said = refused(&daemon, &["get", "sigma0"], 1);
    assert!(said.contains("the scene has no"), "{said}");
    let said = refused(&daemon, &["set", "mass+=1"], 2);
    assert!(said.contains("--by mass=VALUE"), "{said}");
    let said = daemon.ctl_ok(&["set", "mass=1.5"]);
    assert!(said.starts_with("nothing changes, revision 3 stays"), "{said}");

    daemon.ctl_ok(&["scene", "save", "other"]);
    daemon.ctl_ok(&["scene", "save", "mine"]);
    let said = refused(&daemon, &["scene", "rename", "mine", "other"], 1);
    assert!(said.contains("already has a scene `other`"), "{said}");
    daemon.ctl_ok(&["scene", "rename", "mine", "other", "--replace"]);
    daemon.ctl_ok(&["set", "mass=2"]);
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("from other of the library, changed since"), "{shown}");
    let said = refused(&daemon, &["scene", "delete", "mine"], 1);
    assert!(said.contains("there is no scene `mine`"), "{said}");
    daemon.ctl_ok(&["scene", "delete", "other"]);
    let shown = daemon.ctl_ok(&["status"]);
    assert!(!shown.contains("of the library"), "{shown}");
    let said = refused(&daemon, &["scene", "rename", "lugre", "mine"], 1);
    assert!(said.contains("built in"), "{said}");
}
