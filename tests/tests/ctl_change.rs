//! Changing scenes from the command line: units, conditions, ramps, undo, the library, files, and
//! the log of it all.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use system_tests::{Daemon, binary};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(daemon: &Daemon, arguments: &[&str]) -> Value {
    let said = daemon.ctl_ok(&[arguments, &["--json"]].concat());
    serde_json::from_str(&said).unwrap_or_else(|error| panic!("{said}: {error}"))
}

/// Runs what must be refused, and returns what it said.
fn refused(daemon: &Daemon, arguments: &[&str], code: i32) -> String {
    let output = daemon.ctl(arguments);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{arguments:?}: {}",
        text(&output.stderr)
    );
    text(&output.stderr)
}

#[test]
fn values_are_taken_in_the_units_that_people_write() {
    let daemon = Daemon::start(&[]);
    let reply = json(
        &daemon,
        &[
            "set",
            "mass=500g",
            "DV=2mm/s",
            "K=25N/mm",
            "Fs=4N",
            "b=2Ns/m",
            "gamma=5/s",
        ],
    );
    for (name, value) in [
        ("mass", 0.5),
        ("velocity_threshold", 0.002),
        ("stiffness", 25_000.0),
        ("static_force", 4.0),
        ("viscous", 2.0),
        ("rising_rate", 5.0),
    ] {
        assert_eq!(reply["applied"][name], value, "{name}: {reply}");
    }
    let said = refused(&daemon, &["set", "mass=5N"], 2);
    assert!(said.contains("mass is in kg, g or mg"), "{said}");
    let said = refused(&daemon, &["set", "masss=5kg"], 2);
    assert!(said.contains("did you mean `mass`"), "{said}");
    assert_eq!(
        json(&daemon, &["get"])["revision"],
        2,
        "what was refused has changed nothing"
    );
}

#[test]
fn change_accepts_if_revision_ramp_and_dry_run() {
    let daemon = Daemon::start(&[]);
    let tried = json(&daemon, &["set", "mass=2kg", "--dry-run"]);
    assert_eq!((&tried["dry_run"], &tried["revision"]), (&true.into(), &1.into()));
    assert!(tried["tick"].is_null());
    assert!(
        daemon
            .ctl_ok(&["set", "mass=2", "--dry-run"])
            .starts_with("only tried, revision 1 stays")
    );
    assert_eq!(json(&daemon, &["get"])["params"]["mass"], 0.5);

    let ramped = json(&daemon, &["set", "mass=2", "--if-revision", "1", "--ramp", "50ms"]);
    let ticks = ramped["ramp_ends_tick"].as_u64().expect("its end") - ramped["tick"].as_u64().expect("its beginning");
    assert!((49..=51).contains(&ticks), "{ramped}");
    let said = refused(&daemon, &["set", "mass=3", "--if-revision", "1"], 1);
    assert!(
        said.contains("--if-revision = 1") && said.contains("revision 2"),
        "{said}"
    );
    assert!(refused(&daemon, &["set", "mass=3", "--ramp", "50"], 2).contains("50ms"));
    assert!(refused(&daemon, &["set", "mass=3", "--ramp", "11s"], 1).contains("10000 ms"));
}

#[test]
fn what_was_changed_is_taken_back_and_brought_back() {
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["set", "mass=1.5"]);
    daemon.ctl_ok(&["scene", "load", "lugre"]);
    let said = daemon.ctl_ok(&["undo"]);
    assert!(
        said.contains("revision 4") && said.contains("law: lugre -> karnopp"),
        "{said}"
    );
    let said = daemon.ctl_ok(&["undo", "--ramp", "20ms"]);
    assert!(said.contains("mass: 1.5 kg -> 0.5 kg"), "{said}");
    let said = daemon.ctl_ok(&["redo"]);
    assert!(said.contains("mass: 0.5 kg -> 1.5 kg"), "{said}");
    daemon.ctl_ok(&["undo"]);
    assert!(refused(&daemon, &["undo"], 1).contains("nothing to undo"));
}

#[test]
fn a_scene_is_a_name_a_revision_or_a_file() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("tuned by hand.toml");
    let path = file.to_str().expect("text");
    daemon.ctl_ok(&["set", "mass=1.25", "Fs+=5.5"]);
    // What is shown loads again, to the last digit.
    std::fs::write(&file, daemon.ctl_ok(&["scene", "show"])).expect("written");
    daemon.ctl_ok(&["scene", "load", "viscous-drag"]);
    daemon.ctl_ok(&["scene", "load", path]);
    assert_eq!(daemon.ctl_ok(&["scene", "diff", "@2"]), "nothing differs\n");
    assert_eq!(
        json(&daemon, &["get", "@2"])["params"],
        json(&daemon, &["get", path])["params"]
    );
    let said = daemon.ctl_ok(&["scene", "diff", "1", "viscous-drag"]);
    assert!(
        said.contains("law: karnopp -> viscous") && said.contains("mass: 0.5 kg -> none"),
        "{said}"
    );

    let saved = json(&daemon, &["scene", "save", "mine", "--scene", "@2"]);
    assert_eq!(saved["name"], "mine");
    assert!(refused(&daemon, &["scene", "save", "mine"], 1).contains("replace"));
    daemon.ctl_ok(&["scene", "save", "mine", "--replace"]);
    assert!(daemon.ctl_ok(&["scene", "list"]).contains("mine.toml"));
}

#[test]
fn missing_scene_suggests_the_nearest_name() {
    let daemon = Daemon::start(&[]);
    let said = refused(&daemon, &["scene", "load", "viscus-drag"], 1);
    assert!(said.contains("did you mean `viscous-drag`"), "{said}");
    let said = refused(&daemon, &["scene", "diff", "lurge"], 1);
    assert!(said.contains("did you mean `lugre`"), "{said}");
    let said = refused(&daemon, &["get", "ice"], 1);
    assert!(said.contains("there are simulated-friction, no-friction"), "{said}");
    assert!(refused(&daemon, &["scene", "load", "@99"], 1).contains("revision 99 is unknown"));
    assert!(refused(&daemon, &["scene", "load", "missing.toml"], 2).contains("missing.toml"));
    assert!(refused(&daemon, &["scene", "laod", "lugre"], 2).contains("load"));
}

#[test]
fn the_log_says_who_changed_what_and_goes_on() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    assert!(daemon.ctl_ok(&["log"]).contains("nothing has been changed"));
    daemon.ctl_ok(&["set", "mass=1.5"]);
    daemon.ctl_ok(&["stop"]);
    let said = daemon.ctl_ok(&["log"]);
    let year = said.get(..2);
    assert_eq!(year, Some("20"), "it begins with a date: {said}");
    for part in [
        "set  tick",
        "revision 2",
        "    mass: 0.5 kg -> 1.5 kg",
        "stop  idle -> stopped",
    ] {
        assert!(said.contains(part), "{part} is missing: {said}");
    }
    let this = format!("process {})", std::process::id());
    assert!(
        said.contains("process ") && !said.contains(&this),
        "the one that did it is haptic-ctl, not its caller"
    );
    assert_eq!(daemon.ctl_ok(&["log", "-n", "1", "--json"]).lines().count(), 1);

    let mut following = Command::new(binary("haptic-ctl"))
        .args(["log", "-n", "20", "--follow", "log", "--json", "--socket"])
        .arg(daemon.socket())
        .stdout(Stdio::piped())
        .spawn()
        .expect("haptic-ctl starts");
    let mut lines = BufReader::new(following.stdout.take().expect("it is piped")).lines();
    let mut next = || -> Value {
        let line = lines.next().expect("another entry").expect("text");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"))
    };
    assert_eq!(
        (next()["op"].clone(), next()["op"].clone()),
        ("set".into(), "stop".into())
    );
    daemon.ctl_ok(&["reset"]);
    assert_eq!(next()["op"], "reset");
    daemon.ctl_ok(&["undo"]);
    let undo = next();
    assert_eq!((&undo["op"], &undo["seq"]), (&"undo".into(), &4.into()));
    drop(following.kill());
    drop(following.wait());
}
