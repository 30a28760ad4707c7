//! `haptic-ctl recording collect`: recordings of many rigs as one partitioned set.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use system_tests::{ctl, ctl_offline, is_refused, plain};

/// All files of a set, by their places in it.
fn files(set: &Path) -> Vec<String> {
    fn add(directory: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(directory).into_iter().flatten() {
            let path = entry.expect("it can be read").path();
            if path.is_dir() {
                add(&path, found);
            } else {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    add(set, &mut found);
    let inside = |path: &PathBuf| path.strip_prefix(set).expect("below it").display().to_string();
    let mut names: Vec<String> = found.iter().map(inside).collect();
    names.sort();
    names
}

#[test]
fn recordings_are_collected_by_rig_and_date_never_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let set = directory.path().join("set");
    let first = directory.path().join("a b.csv");
    let fixture = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures")).expect("the fixtures");
    let mut fixtures: Vec<PathBuf> = fixture.map(|entry| entry.expect("a file").path()).collect();
    fixtures.sort();
    drop(ctl_offline(&[
        "recording",
        "export",
        plain(&fixtures[0]),
        plain(&first),
    ]));
    let before = haptic_recording::read(&first).expect("a recording");
    let collect = |more: &[&str]| -> Output {
        let arguments = [&["recording", "collect", plain(&set)], more].concat();
        ctl(Path::new("/nonexistent"), &arguments)
    };
    assert!(collect(&["--as", "left", plain(&first)]).status.success());
    assert!(collect(&["--as", "right", plain(&first)]).status.success());
    let names = files(&set);
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
    assert_eq!(files(&set), names);
    let listed = collect(&["--json", plain(&new)]);
    let listed: Vec<serde_json::Value> = serde_json::from_slice(&listed.stdout).expect("a list");
    assert_eq!(listed[0]["rows"], before.rows.len());
    assert_eq!(
        files(&set).iter().filter(|name| name.starts_with("rig=fake")).count(),
        1,
        "{:?}",
        files(&set)
    );

    for rig in ["a/b", ""] {
        is_refused(rig, &collect(&["--as", rig, plain(&new)]), 2, &["rig"]);
    }
}
