//! `haptic-ctl recording`: what it says of a recording, and recordings of many rigs as one partitioned set. That every
//! format holds the same, and what a cut and a repair keep, the tests of haptic-recording show.

use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use system_tests::recorded::read;
use system_tests::{ctl, ctl_offline, ctl_offline_json, ctl_offline_refused, files, is_refused, plain, text};

/// A recording of three scenes, and of the ramp to force.
const FIXTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/recording-of-servo-3.csv");

/// All files of a set, by their places in it.
fn places(set: &Path) -> Vec<String> {
    let inside = |path: PathBuf| plain(path.strip_prefix(set).expect("below it")).to_owned();
    files(set).into_iter().map(inside).collect()
}

#[test]
fn info_tells_what_a_recording_holds() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("session.csv");
    // With a note, and a marker before the next state.
    let recorded = fs::read_to_string(FIXTURE).expect("the fixture");
    let (marker, state) = (
        r#"{"mark":"marker","tick":400,"text":"third"}"#,
        r#"{"mark":"state","tick":451"#,
    );
    let recorded = recorded
        .replacen("\"scene\":", "\"notes\":\"two scenes\",\"scene\":", 1)
        .replacen(&format!("# {state}"), &format!("# {marker}\n# {state}"), 1);
    fs::write(&file, recorded).expect("written");
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
    let events = info["events"].as_array().expect("a list");
    for (kind, name, wanted) in [
        ("state", "state", json!(["idle", "engaging", "engaged"])),
        ("scene", "revision", json!([2, 3, 4, 5])),
        ("marker", "text", json!(["third"])),
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
    for part in ["third", "engaged", "revision 2", "every tick"] {
        assert!(printed.contains(part), "{printed} lacks {part}");
    }
    let missing = ["recording", "info", "/nowhere.mcap"];
    ctl_offline_refused(&missing, 2, &["/nowhere.mcap", "No such file"]);
}

#[test]
fn recordings_are_collected_by_rig_and_date_never_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let set = directory.path().join("set");
    let first = directory.path().join("a b.csv");
    drop(ctl_offline(&["recording", "export", FIXTURE, plain(&first)]));
    let before = haptic_recording::read(&first).expect("a recording");
    let collect = |more: &[&str]| -> Output {
        let arguments = [&["recording", "collect", plain(&set)], more].concat();
        ctl(Path::new("/nonexistent"), &arguments)
    };
    assert!(collect(&["--as", "left", plain(&first)]).status.success());
    assert!(collect(&["--as", "right", plain(&first)]).status.success());
    let names = places(&set);
    assert_eq!(names.len(), 2, "{names:?}");
    for (name, rig) in names.iter().zip(["left", "right"]) {
        let parts: Vec<&str> = name.split('/').collect();
        assert_eq!(parts[0], format!("rig={rig}"));
        let date = parts[1].strip_prefix("date=").expect("a date");
        assert!(date.len() == 10 && date.starts_with("20"), "{date}");
        assert!(parts[2].ends_with("-a-b.parquet") && parts.len() == 3, "{name}");
    }
    // A file of the set is a recording like any other.
    let after = haptic_recording::read(&set.join(&names[0])).expect("a recording");
    assert_eq!((after.rows, after.marks), (before.rows.clone(), before.marks.clone()));

    // By default its rig is the device. None is written where one of them is there already.
    let new = directory.path().join("new.csv");
    fs::copy(&first, &new).expect("copied");
    let refused = collect(&["--as", "left", plain(&new), plain(&first)]);
    is_refused("left", &refused, 2, &["nothing of a set is replaced"]);
    is_refused("twice", &collect(&[plain(&new), plain(&new)]), 2, &[]);
    assert_eq!(places(&set), names);
    let listed = collect(&["--json", plain(&new)]);
    let listed: Vec<serde_json::Value> = serde_json::from_slice(&listed.stdout).expect("a list");
    assert_eq!(listed[0]["rows"], before.rows.len());
    let names = places(&set);
    let of_the_device = names.iter().filter(|name| name.starts_with("rig=fake"));
    assert_eq!(of_the_device.count(), 1, "{names:?}");

    for rig in ["a/b", ""] {
        is_refused(rig, &collect(&["--as", rig, plain(&new)]), 2, &["rig"]);
    }
}
