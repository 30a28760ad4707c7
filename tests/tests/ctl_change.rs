//! Changing scenes from the command line: conditions, ramps, ticks to come, relative changes, the library and files.

use haptic_ipc::{Request, Timing};
use serde_json::{Value, json};
use system_tests::{Daemon, plain, status};

#[test]
fn change_accepts_if_revision_ramp_and_dry_run() {
    let daemon = Daemon::start(&[]);
    let tried = daemon.ctl_json(&["set", "mass=2kg", "--dry-run"]);
    assert_eq!((&tried["dry_run"], &tried["revision"]), (&true.into(), &1.into()));
    assert!(tried["tick"].is_null());
    let printed = daemon.ctl_ok(&["set", "mass=2", "--dry-run"]);
    assert!(printed.starts_with("only tried, revision 1 stays"), "{printed}");
    assert_eq!(daemon.ctl_json(&["get"])["params"]["mass"], 0.5);

    let ramped = daemon.ctl_json(&["set", "mass=2", "--if-revision", "1", "--ramp", "50ms"]);
    let ticks = ramped["ramp_ends_tick"].as_u64().expect("its end") - ramped["tick"].as_u64().expect("its beginning");
    assert!((49..=51).contains(&ticks), "{ramped}");
    daemon.ctl_refused(&["set", "mass=3", "--if-revision", "1"], 1, "revision 2");
    // A condition on the value holds at once: `--wait` is for the ramp.
    let ramped = daemon.ctl_json(&["set", "mass=3", "--ramp", "300ms", "--wait"]);
    let timing: Timing = daemon.client().request(Request::Timing {}).expect("it answers");
    assert!(
        timing.since_start.ticks >= ramped["ramp_ends_tick"].as_u64().expect("its end"),
        "{ramped}"
    );
    // The advice is on the scene as it is then, whatever was changed.
    for (line, is_stiff) in [
        ("set K=200N/mm", true),
        ("set Fs=5", true),
        ("set K=1N/mm", false),
        ("undo", true),
    ] {
        let printed = daemon.ctl_ok(&line.split(' ').collect::<Vec<_>>());
        let mut notes = printed.lines().filter_map(|line| line.strip_prefix("note: "));
        let found = notes.any(|note| note.contains("against a stuck block the loop oscillates"));
        assert_eq!(found, is_stiff, "{line}: {printed}");
    }
}

#[test]
fn a_scene_is_a_name_a_revision_or_a_file() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("tuned by hand.toml");
    let path = plain(&file);
    daemon.ctl_ok(&["set", "mass=1.25", "Fs+=5.5"]);
    // What is shown loads again, to the last digit.
    std::fs::write(&file, daemon.ctl_ok(&["scene", "show"])).expect("written");
    daemon.ctl_ok(&["scene", "load", "viscous-drag"]);
    daemon.ctl_ok(&["scene", "load", path]);
    assert_eq!(daemon.ctl_ok(&["scene", "diff", "@2"]), "nothing differs\n");
    assert_eq!(
        daemon.ctl_json(&["get", "@2"])["params"],
        daemon.ctl_json(&["get", path])["params"]
    );
    let printed = daemon.ctl_ok(&["scene", "diff", "1", "viscous-drag"]);
    assert!(
        printed.contains("law: karnopp -> viscous") && printed.contains("mass: 0.5 kg -> none"),
        "{printed}"
    );

    let saved = daemon.ctl_json(&["scene", "save", "mine", "--scene", "@2"]);
    assert_eq!(saved["name"], "mine");
    daemon.ctl_ok(&["scene", "save", "mine", "--replace"]);
    assert!(daemon.ctl_ok(&["scene", "list"]).contains("mine.toml"));
}

#[test]
fn schedule_file_is_awaited_and_kept_one_cancelled_by_name() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("steps.json");
    let file = plain(&file);
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
    let printed = daemon.ctl_ok(&["schedule", file, "--json"]);
    let rendered = printed.lines().skip(1).map(|line| {
        let entry: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"));
        json!([entry["tick"], entry["op"]])
    });
    let wanted = [json!([first, "set"]), json!([first + 7, "scene.load"])];
    assert_eq!(rendered.collect::<Vec<_>>(), wanted);
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("viscous-drag of the library"), "{shown}");

    daemon.ctl_ok(&["scene", "load", "simulated-friction"]);
    write(first + 1_000_000);
    daemon.ctl_ok(&["schedule", file, "--keep", "--name", "later"]);
    let shown = daemon.ctl_ok(&["status"]);
    assert!(shown.contains("2 changes (later) from tick"), "{shown}");
    daemon.ctl_refused(&["set", "b=9"], 1, "schedule cancel");
    let printed = daemon.ctl_ok(&["schedule", "cancel", "later"]);
    assert!(printed.starts_with("cancelled: 2 changes"), "{printed}");
    daemon.ctl_refused(&["schedule", "cancel", "later"], 1, "");
    daemon.ctl_refused(&["set", "b=9", "--at-tick", "1"], 1, "at_tick = 1 is out of range");
}
