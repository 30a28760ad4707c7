//! `haptic-ctl recording`: what it says of a recording that a daemon has made, and what it makes of one. That every
//! format holds the same, and what a cut and a repair keep, the tests of haptic-recording show.

use rustix::process::Signal;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use system_tests::recorded::read;
use system_tests::{Daemon, binary, ctl_offline, ctl_offline_json, ctl_offline_refused, plain, process, text, until};

/// A recording of two scenes and the ramp to force, with a marker before and one after each change.
fn session(folder: &Path) -> PathBuf {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let file = folder.join("session.csv");
    let mut recorder = Command::new(binary("haptic-ctl"))
        .args(["record", plain(&file), "--notes", "two scenes", "--markers-from-stdin"])
        .arg("--socket")
        .arg(daemon.socket())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("haptic-ctl starts");
    let mut lines = recorder.stdin.take().expect("it is piped");
    let mut mark = |text: &str| {
        writeln!(lines, "{text}").expect("written");
        until("waited in vain for the marker", || {
            std::fs::read_to_string(&file).is_ok_and(|found| found.contains(&format!("\"{text}\"")))
        });
    };
    mark("first");
    daemon.ctl_ok(&["set", "mass=1.5"]);
    mark("second");
    daemon.ctl_ok(&["engage", "--wait"]);
    mark("third");
    process::signal(recorder.id(), Signal::INT);
    assert!(recorder.wait().expect("it ends").success());
    file
}

#[test]
fn info_tells_what_a_recording_holds() {
    let folder = tempfile::tempdir().expect("a directory");
    let file = session(folder.path());
    let found = read(&file);
    let info = ctl_offline_json(&["recording", "info", plain(&file)]);
    assert_eq!(info["rows"], found.rows.len());
    let [first, last] = [0, found.rows.len() - 1].map(|index| found.rows[index]);
    assert_eq!(info["ticks"], json!([first.tick, last.tick]));
    assert_eq!(info["length_s"], last.t_s - first.t_s);
    assert_eq!(
        (&info["complete"], &info["notes"]),
        (&true.into(), &"two scenes".into())
    );
    // On a busy machine what a person does and what the daemon tells may come in another order.
    let events = info["events"].as_array().expect("a list");
    for (kind, name, wanted) in [
        ("state", "state", json!(["idle", "engaging", "engaged"])),
        ("scene", "revision", json!([2])),
        ("marker", "text", json!(["first", "second", "third"])),
    ] {
        let of_kind = events.iter().filter(|event| event["kind"] == kind);
        let found: Value = of_kind.map(|event| event[name].clone()).collect();
        assert_eq!(found, wanted, "{events:?}");
    }
    for event in events {
        let (tick, t_s) = (event["tick"].as_u64(), event["t_s"].as_f64().expect("a time"));
        let at = found.rows.iter().find(|row| Some(row.tick) >= tick).unwrap_or(&last);
        assert!((at.t_s - first.t_s - t_s).abs() < 0.05, "{event}");
    }
    let printed = text(&ctl_offline(&["recording", "info", plain(&file)]).stdout);
    for part in [
        "two scenes",
        "marker",
        "third",
        "engaged",
        "revision 2",
        "every tick",
        "complete",
    ] {
        assert!(printed.contains(part), "{printed} lacks {part}");
    }
    ctl_offline_refused(
        &["recording", "info", "/nowhere.mcap"],
        2,
        &["/nowhere.mcap", "No such file"],
    );
}
