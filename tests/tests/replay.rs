//! A recording holds all that its forces were computed from: a servo that is built from its metadata and
//! stepped through its rows gives every one of them again, to the last bit.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use system_tests::{binary, is_refused, stderr, text};

/// `haptic-ctl replay` of a file.
fn ctl(file: &Path, arguments: &[&str]) -> Output {
    Command::new(binary("haptic-ctl"))
        .arg("replay")
        .arg(file)
        .args(arguments)
        .output()
        .expect("haptic-ctl runs")
}

/// What `haptic-ctl replay` says of a file, and its exit code.
fn ctl_json(file: &Path, arguments: &[&str]) -> (Value, Option<i32>) {
    let output = ctl(file, &[arguments, &["--json"]].concat());
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
        let (printed, code) = ctl_json(&file, &[]);
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
    is_refused("another", &ctl(&file, &[]), 1, &["made by version 1 of the servo"]);
    let (rendered, code) = ctl_json(&file, &["--scheme", "exact"]);
    assert_eq!(
        (code, &rendered["what_if"]["ticks"]),
        (Some(0), &rendered["recorded"]["ticks"])
    );
}

/// The first recording by an earlier build, with the cell of a column changed in one of its rows.
fn damaged(to: &Path, line: usize, column: &str, cell: &str) -> u64 {
    let text = std::fs::read_to_string(&fixtures()[0]).expect("the fixture");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let place = haptic_ipc::SAMPLE_COLUMNS.iter().position(|name| *name == column);
    let mut cells: Vec<&str> = lines[line].split(',').collect();
    let tick = cells[0].parse().expect("a row");
    cells[place.expect("a column")] = cell;
    lines[line] = cells.join(",");
    std::fs::write(to, lines.join("\n") + "\n").expect("it is written");
    tick
}

#[test]
fn the_first_tick_that_differs_is_named_and_the_exit_code_is_1() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("damaged.csv");
    let tick = damaged(&file, 700, "command_force_N", "1.5");
    let (printed, code) = ctl_json(&file, &[]);
    assert_eq!((&printed["differing"], code), (&1.into(), Some(1)), "{printed}");
    let first = &printed["first_differing"];
    assert_eq!(
        (&first["tick"], &first["column"]),
        (&tick.into(), &"command_force_N".into())
    );
    assert_eq!(first["recorded"], 1.5);
    assert!(
        first["likely"]
            .as_str()
            .is_some_and(|text| text.contains("revision 3 (karnopp)")),
        "{first}"
    );
    let printed = text(&ctl(&file, &[]).stdout);
    assert!(printed.contains(&format!("first at tick {tick}")), "{printed}");
}
