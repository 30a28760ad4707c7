//! Files of other programs: odd, but legal tables are read, and whatever is not is refused with what to do.

use std::fmt::Write;
use std::path::Path;
use system_tests::{ctl, ctl_offline, ctl_offline_json, ctl_offline_refused, text};

/// A record of time (s), position (m) and force (N), as every table below holds it.
pub(crate) struct Base {
    directory: tempfile::TempDir,
    pub(crate) rows: Vec<[f64; 3]>,
}

impl Base {
    /// What a lab records of aluminium on Teflon, of which every tenth sample of 16 s is kept.
    pub(crate) fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let surface = directory.path().join("surface.csv").display().to_string();
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/aluminium-on-teflon.toml");
        drop(ctl_offline(&[
            "surface", scene, "--mass", "1", "--seed", "1", "--out", &surface,
        ]));
        let text = std::fs::read_to_string(surface).expect("a record");
        let number = |cell: &str| cell.parse().expect("a number");
        let row = |line: &str| {
            let cells: Vec<f64> = line.split(',').map(number).collect();
            [cells[0], cells[1], cells[2]]
        };
        let rows = text.lines().skip(1).step_by(10).take(1600).map(row).collect();
        Self { directory, rows }
    }

    /// A file of the directory.
    pub(crate) fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let path = self.directory.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path.display().to_string()
    }

    /// A heading, and a line for each row.
    fn lines(&self, heading: &str, line: impl Fn(usize, [f64; 3]) -> String) -> String {
        let mut text = heading.to_owned();
        for (index, row) in self.rows.iter().enumerate() {
            writeln!(text, "{}", line(index, *row)).expect("a string takes it");
        }
        text
    }

    pub(crate) fn plain(&self) -> String {
        self.lines("t_s,position_m,force_N\n", |_, [t, x, f]| {
            format!("{t:.4},{x:.7},{f:.6}")
        })
    }

    /// The usual table with another unit of force.
    fn of_force(&self, column: &str, unit_n: f64) -> String {
        let heading = format!("t_s,position_m,{column}\n");
        self.lines(&heading, |_, [t, x, f]| format!("{t:.4},{x:.7},{:.8}", f / unit_n))
    }
}

fn of_program(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("other-programs");
    folder.join(name).display().to_string()
}

#[test]
fn odd_but_legal_tables_hold_the_same_record() {
    let base = Base::new();
    let plain = base.plain();
    let german = |value: f64, digits: usize| format!("{value:.digits$}").replace('.', ",");
    let german = base.lines("Zeit (s);Weg [mm];Kraft (N)\n", |_, [t, x, f]| {
        format!("{};{};{}", german(t, 4), german(1e3 * x, 4), german(f, 6))
    });
    let others = base.lines(
        "valve_V,Force (N),note,Elapsed Time (ms),x [um]\n",
        |index, [t, x, f]| format!("0.{index},{f:.6},ok,{:.3},{:.2}", 1e3 * t, 1e6 * x),
    );
    let real = base.put("plain.csv", &plain);
    let same = |path: &str| {
        let found = ctl_offline_json(&["compare", &real, path, "--align", "time"]);
        let rms = found["force_rms_difference_N"].as_f64().expect("a number");
        assert!(rms < 0.01, "{path}: {found}");
    };
    for (name, table) in [
        ("tabs.tsv", plain.replace(',', "\t")),
        ("remarks.csv", format!("% bench 3\n# probe 7\nRate: 100 Hz\n\n{plain}")),
        ("german.csv", german),
        ("ounce-force.csv", base.of_force("force_ozf", 0.278_013_850_953_781)),
        ("other-columns.csv", others),
    ] {
        same(&base.put(name, table));
    }
    // pandas, with moments, single precision and whole numbers.
    same(&of_program("data-frame.parquet"));
}

#[test]
fn what_cannot_be_read_is_refused_with_the_place_and_what_to_do() {
    let base = Base::new();
    let plain = base.plain();
    let line = |number: usize, text: &str| {
        let mut lines: Vec<&str> = plain.lines().collect();
        lines[number - 1] = text;
        lines.join("\n")
    };
    let real = base.put("plain.csv", &plain);
    let volts = base.put("volts.csv", base.of_force("force_V", 4.0));
    let bare = base.put("bare.csv", plain.split_once('\n').expect("a heading").1);
    let (frame, mcap) = (of_program("data-frame.parquet"), of_program("json.mcap"));
    let out = base.directory.path().join("out.csv").display().to_string();
    for (arguments, parts) in [
        (vec!["identify", &volts], ["unit of `force_V`", "--force-gain"]),
        (vec!["identify", &bare], ["column among `1,2,3`", "--time-column"]),
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
    for (name, table, part) in [
        (
            "nan.csv",
            line(20, "0.18,nan,1"),
            "1 row lacks a number, the first in line 20",
        ),
        (
            "back.csv",
            line(20, "0.01,0.001,1"),
            "line 20: the time 0.01 s is wrong between its neighbours",
        ),
    ] {
        let printed = text(&ctl(Path::new("/nonexistent"), &["identify", &base.put(name, table)]).stdout);
        assert!(printed.contains(part), "{printed} lacks {part}");
    }
}
