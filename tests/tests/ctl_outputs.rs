//! Files that `haptic-ctl` writes: nothing is replaced, and one rule for the exit codes.

use haptic_recording::Ending;
use std::path::{Path, PathBuf};
use system_tests::{Daemon, ctl_offline_refused, stderr};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Each command that writes a table or a recording, with the name of what it writes.
fn commands(out: &str) -> [Vec<String>; 6] {
    [
        "simulate SCENE --motion MOTION --out OUT",
        "replay RECORDING --scheme exact --out OUT",
        "recording export RECORDING OUT",
        "recording cut RECORDING OUT",
        "recording repair RECORDING OUT",
        "surface SCENE --out OUT",
    ]
    .map(|line| {
        let word = |word| match word {
            "SCENE" => format!("{ROOT}/scenes/lugre.toml"),
            "MOTION" => format!("{ROOT}/crates/haptic-core/tests/data/reference/paper.csv"),
            "RECORDING" => format!("{ROOT}/tests/fixtures/recording-of-servo-3.csv"),
            "OUT" => out.to_owned(),
            other => other.to_owned(),
        };
        line.split(' ').map(word).collect()
    })
}

fn ends(arguments: &[String], code: i32, parts: &[&str]) {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    ctl_offline_refused(&arguments, code, parts);
}

fn file(directory: &Path, name: &str) -> (PathBuf, String) {
    let path = directory.join(name);
    let text = path.display().to_string();
    (path, text)
}

#[test]
fn existing_file_is_kept_unless_force_option_is_given() {
    let directory = tempfile::tempdir().expect("a directory");
    let (there, name) = file(directory.path(), "there.csv");
    for mut arguments in commands(&name) {
        std::fs::write(&there, "mine").expect("written");
        ends(&arguments, 2, &["there.csv exists; --force replaces it"]);
        assert_eq!(std::fs::read(&there).expect("it is there"), b"mine");
        // The surface takes seconds, and writes as the others do.
        if arguments[0] != "surface" {
            arguments.push("--force".to_owned());
            ends(&arguments, 0, &[]);
            assert_ne!(std::fs::read(&there).expect("it is there"), b"mine");
        }
    }
}

#[test]
fn a_name_that_cannot_be_is_wrong_usage_and_a_full_disk_is_not() {
    let directory = tempfile::tempdir().expect("a directory");
    let (other, name) = file(directory.path(), "other.txt");
    for arguments in commands(&name) {
        ends(&arguments, 2, &["other.txt", ".csv"]);
        assert!(!other.exists());
    }
    let (_, name) = file(directory.path(), "nowhere/out.csv");
    for arguments in commands(&name).iter().filter(|arguments| arguments[0] != "surface") {
        ends(arguments, 2, &["nowhere/out.csv: No such file"]);
    }
    if !Path::new("/dev/full").exists() {
        test_run::skip("/dev/full", "a system that has it");
        return;
    }
    for arguments in &commands("/dev/full")[..2] {
        ends(arguments, 1, &["/dev/full: No space left"]);
    }
}

#[test]
fn a_recording_goes_to_standard_output() {
    let daemon = Daemon::start(&[]);
    let directory = tempfile::tempdir().expect("a directory");
    for format in ["csv", "mcap"] {
        let output = daemon.ctl(&["record", "-", "--format", format, "--for", "50ms"]);
        let message = stderr(&output);
        assert!(output.status.success() && message.contains(" rows, "), "{message}");
        let (file, _) = file(directory.path(), &format!("piped.{format}"));
        std::fs::write(&file, &output.stdout).expect("written");
        let recording = haptic_recording::read(&file).expect("a recording");
        assert_eq!(recording.ending, Ending::Complete, "{format}");
        // A tick that comes late moves the end by a row.
        let rows = recording.rows.len();
        assert!((40..=60).contains(&rows), "{format}: {rows}");
    }
    let output = daemon.ctl(&["record", "-", "--for", "5ms", "--quiet"]);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    let output = daemon.ctl(&["record", "-", "--for", "5ms", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stderr).expect("an object");
    assert!(report["rows"].as_u64().is_some_and(|rows| rows > 0), "{report}");

    daemon.ctl_refused(&["record", "-", "--format", "parquet"], 2, "");
}
