//! Files of other programs through the whole of haptic-ctl: what is read, and what is refused with what to do. Every odd,
//! but legal table is read by the tests of haptic-lab.

use std::fmt::Write;
use std::path::Path;
use system_tests::{ctl, ctl_offline, ctl_offline_json, ctl_offline_refused, plain, text};

/// A record of time (s), position (m) and force (N), as every table below holds it.
struct Base {
    directory: tempfile::TempDir,
    rows: Vec<[f64; 3]>,
}

impl Base {
    /// What a lab records of aluminium on Teflon, of which every tenth sample of 16 s is kept.
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let surface = directory.path().join("surface.csv");
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/aluminium-on-teflon.toml");
        let draw = ["surface", scene, "--mass", "1", "--seed", "1", "--out", plain(&surface)];
        drop(ctl_offline(&draw));
        let text = std::fs::read_to_string(surface).expect("a record");
        let row = |line: &str| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            [cells[0], cells[1], cells[2]]
        };
        let rows = text.lines().skip(1).step_by(10).take(1600).map(row).collect();
        Self { directory, rows }
    }

    /// A file of the directory.
    fn put(&self, name: &str, text: &str) -> String {
        let path = self.directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    }

    /// The usual table with a column of force in a unit.
    fn of_force(&self, column: &str, unit_n: f64) -> String {
        let mut text = format!("t_s,position_m,{column}\n");
        for [t, x, f] in &self.rows {
            writeln!(text, "{t:.4},{x:.7},{:.8}", f / unit_n).expect("a string takes it");
        }
        text
    }
}

fn of_program(name: &str) -> String {
    format!("{}/other-programs/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn odd_but_legal_tables_hold_the_same_record() {
    let base = Base::new();
    let real = base.put("plain.csv", &base.of_force("force_N", 1.0));
    let ounces = base.put("ounce-force.csv", &base.of_force("force_ozf", 0.278_013_850_953_781));
    // And of pandas, with moments, single precision and whole numbers.
    for path in [ounces, of_program("data-frame.parquet")] {
        let found = ctl_offline_json(&["compare", &real, &path, "--align", "time"]);
        let rms = found["force_rms_difference_N"].as_f64().expect("a number");
        assert!(rms < 0.01, "{path}: {found}");
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_the_place_and_what_to_do() {
    let base = Base::new();
    let plain = base.of_force("force_N", 1.0);
    let real = base.put("plain.csv", &plain);
    let volts = base.put("volts.csv", &base.of_force("force_V", 4.0));
    let (frame, mcap) = (of_program("data-frame.parquet"), of_program("json.mcap"));
    let out = base.directory.path().join("out.csv").display().to_string();
    for (arguments, parts) in [
        (vec!["identify", &volts], ["unit of `force_V`", "--force-gain"]),
        (
            vec!["identify", &mcap],
            ["did not write this MCAP file", "CSV and Parquet"],
        ),
        (
            vec!["identify", &frame, "--force-column", "operator"],
            ["`operator`", "numbers expected"],
        ),
        // `compare` has no options for columns.
        (vec!["compare", &real, &volts], ["unit of `force_V`", "heading"]),
        (
            vec!["simulate", "no-friction", "--motion", &mcap, "--out", &out],
            ["compressed by zstd", "without compression"],
        ),
        // Without the inputs of the servo there is nothing to replay, convert or cut.
        (vec!["replay", &real], ["not a recording", "haptic-ctl identify"]),
        (
            vec!["recording", "info", &mcap],
            ["did not write this MCAP file", "haptic-ctl identify"],
        ),
        (
            vec!["recording", "export", &frame, &out],
            ["not a recording", "haptic-ctl identify"],
        ),
        (
            vec!["recording", "cut", &real, &out, "--from", "1s"],
            ["not a recording", "haptic-ctl identify"],
        ),
    ] {
        let message = ctl_offline_refused(&arguments, 2, &parts);
        assert!(
            !message.contains("repair"),
            "{arguments:?}: nothing of it can be repaired: {message}"
        );
    }
    assert!(!Path::new(&out).exists());
    // What a row lacks is a gap, and a time that is wrong between its neighbours is left out.
    for (row, part) in [
        ("0.18,nan,1", "1 row lacks a number, the first in line 20"),
        (
            "0.01,0.001,1",
            "line 20: the time 0.01 s is wrong between its neighbours",
        ),
    ] {
        let mut lines: Vec<&str> = plain.lines().collect();
        lines[19] = row;
        let path = base.put("damaged.csv", &lines.join("\n"));
        let printed = text(&ctl(Path::new("/nonexistent"), &["identify", &path]).stdout);
        assert!(printed.contains(part), "{printed} lacks {part}");
    }
}
