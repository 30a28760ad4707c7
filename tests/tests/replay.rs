//! A recording holds all that its forces were computed from: a servo that is built from its metadata and
//! stepped through its rows gives every one of them again, to the last bit.

use serde_json::Value;
use std::path::{Path, PathBuf};
use system_tests::{ctl, ctl_offline_refused, plain, stderr};

/// What `haptic-ctl replay` says of a file, and its exit code.
fn replay(file: &Path, arguments: &[&str]) -> (Value, Option<i32>) {
    let words = [&["replay", "--json", plain(file)], arguments].concat();
    let output = ctl(Path::new("/nonexistent"), &words);
    let report = serde_json::from_slice(&output.stdout);
    (
        report.unwrap_or_else(|error| panic!("{error}: {}", stderr(&output))),
        output.status.code(),
    )
}

/// Recordings by earlier builds with this version of the servo. The settings of their loops have no usual value.
fn fixtures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let name = format!("recording-of-servo-{}", haptic_core::servo::VERSION);
    ["csv", "mcap"]
        .map(|kind| folder.join(&name).with_extension(kind))
        .into()
}

#[test]
fn a_recording_of_an_earlier_build_gives_its_forces_again() {
    let directory = tempfile::tempdir().expect("a directory");
    // As an earlier recorder wrote it: the servo settles within its rest.
    let without = directory.path().join("without-snapshots.csv");
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let kept: Vec<&str> = text
        .lines()
        .filter(|line| !line.contains(r#""mark":"snapshot""#))
        .collect();
    assert_eq!(kept.len() + 1, text.lines().count());
    std::fs::write(&without, kept.join("\n") + "\n").expect("it is written");
    let files = fixtures().into_iter().map(|file| (file, 0)).chain([(without, 300)]);
    for (file, most) in files {
        let (printed, code) = replay(&file, &[]);
        assert_eq!(
            (&printed["differing"], code),
            (&0.into(), Some(0)),
            "{}: {printed}",
            file.display()
        );
        assert_eq!(printed["ticks"], 2300, "{printed}");
        assert!(printed["not_compared"].as_u64() <= Some(most), "{printed}");
        assert!(printed["with_force"].as_u64() > Some(1500), "{printed}");
    }
}

#[test]
fn recording_by_other_servo_is_named_and_still_rendered() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("other.csv");
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let version = format!("\"version\":{}", haptic_core::servo::VERSION);
    std::fs::write(&file, text.replace(&version, "\"version\":1")).expect("written");
    ctl_offline_refused(&["replay", plain(&file)], 1, &["made by version 1 of the servo"]);
    let (rendered, code) = replay(&file, &["--scheme", "exact"]);
    assert_eq!(
        (code, &rendered["what_if"]["ticks"]),
        (Some(0), &rendered["recorded"]["ticks"])
    );
}

#[test]
fn the_first_tick_that_differs_is_named_and_the_exit_code_is_1() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("damaged.csv");
    // A row with another force.
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<&str> = lines[700].split(',').collect();
    let tick: u64 = cells[0].parse().expect("a row");
    let force = haptic_ipc::SAMPLE_COLUMNS
        .iter()
        .position(|name| *name == "command_force_N");
    cells[force.expect("a column")] = "1.5";
    lines[700] = cells.join(",");
    std::fs::write(&file, lines.join("\n") + "\n").expect("it is written");
    let (printed, code) = replay(&file, &[]);
    assert_eq!((&printed["differing"], code), (&1.into(), Some(1)), "{printed}");
    let said = ctl(Path::new("/nonexistent"), &["replay", plain(&file)]);
    let said = system_tests::text(&said.stdout);
    assert!(said.contains(&format!("first at tick {tick} ")), "{said}");
    let first = &printed["first_differing"];
    assert_eq!(
        (&first["tick"], &first["column"]),
        (&tick.into(), &"command_force_N".into())
    );
    assert_eq!(first["recorded"], 1.5);
    let likely = first["likely"].as_str().unwrap_or_default();
    assert!(likely.contains("revision 3 (karnopp)"), "{first}");
}
