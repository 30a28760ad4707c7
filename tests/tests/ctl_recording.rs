//! `haptic-ctl recording`: what it says of a recording that a daemon has made, and what it makes of one. That every
//! format holds the same, and what a cut and a repair keep, the tests of haptic-recording show.

use haptic_recording::{Ending, Mark};
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

#[test]
fn a_part_is_cut_by_markers_and_times() {
    let folder = tempfile::tempdir().expect("a directory");
    let file = session(folder.path());
    let (path, whole) = (plain(&file), read(&file));
    let place = |text: &str| {
        let is_it = |(_, mark): &&(usize, Mark)| matches!(mark, Mark::Marker { text: found, .. } if found == text);
        whole.marks.iter().find(is_it).expect("a marker").0
    };
    let at = |t_s: f64| {
        whole
            .rows
            .partition_point(|row| row.t_s - whole.rows[0].t_s < t_s - 5e-6)
    };
    let out = folder.path().join("part.csv");
    for (arguments, rows) in [
        (
            ["--from-marker", "second", "--to-marker", "third"],
            place("second")..place("third"),
        ),
        (["--from", "3ms", "--to", "12ms"], at(0.003)..at(0.012)),
    ] {
        let cut = [&["recording", "cut", path, plain(&out), "--force"], &arguments[..]].concat();
        let report = ctl_offline_json(&cut);
        let part = read(&out);
        assert_eq!(part.rows, whole.rows[rows.clone()], "{arguments:?}");
        assert_eq!((&report["rows"], part.ending), (&rows.len().into(), Ending::Complete));
    }
    let nothing = folder.path().join("nothing.csv");
    for (arguments, part) in [
        (["--from-marker", "fourth"].as_slice(), "`first`, `second`, `third`"),
        (&["--from", "1h"], "is within the cut"),
        (&["--from", "2s", "--to", "1s"], "begins at 2.000 s"),
        (
            &["--from-marker", "third", "--to-marker", "first"],
            "the end must come after",
        ),
        (&["--from", "2s", "--from-marker", "first"], "cannot be used with"),
    ] {
        ctl_offline_refused(
            &[&["recording", "cut", path, plain(&nothing)], arguments].concat(),
            2,
            &[part],
        );
        assert!(!nothing.exists(), "{arguments:?}");
    }
}

#[test]
fn what_can_be_read_is_kept_by_a_repair() {
    let folder = tempfile::tempdir().expect("a directory");
    let file = session(folder.path());
    let whole = read(&file);
    let csv = std::fs::read_to_string(&file).expect("text");
    let lines: Vec<&str> = csv.lines().collect();
    let is_row = |index: &usize| !lines[*index].starts_with('#');
    let half = (lines.len() / 2..).find(is_row).expect("a row");
    let before: usize = lines[..half].iter().map(|line| line.len() + 1).sum();
    let (broken, out) = (folder.path().join("broken.csv"), folder.path().join("repaired.csv"));
    std::fs::write(&broken, format!("{}x{}", &csv[..before], &csv[before..])).expect("written");
    let (broken, out) = (plain(&broken), plain(&out));
    for reads in [
        &["recording", "export", broken, out][..],
        &["recording", "info", broken],
        &["identify", broken],
    ] {
        ctl_offline_refused(reads, 2, &["broken.csv", "is not a row", "recording repair"]);
        assert!(!Path::new(out).exists(), "half of a recording is not one");
    }
    ctl_offline_refused(&["replay", broken], 1, &["recording repair"]);
    let report = ctl_offline_json(&["recording", "repair", broken, out]);
    assert!(
        report["dropped_bytes"].as_u64().is_some_and(|bytes| bytes > 50),
        "{report}"
    );
    let found = read(Path::new(out));
    assert_eq!(
        (found.rows.len(), found.ending),
        (whole.rows.len() - 1, Ending::Complete)
    );
    assert!(
        found.marks.iter().any(|(_, mark)| *mark == Mark::Lost { rows: 1 }),
        "{report}"
    );
}
