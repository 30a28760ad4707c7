//! Files of other programs: odd, but legal tables are read, and whatever is not is refused with what to do.

use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use system_tests::{binary, ctl, ctl_offline};

/// Time between two samples, s.
const PERIOD_S: f64 = 0.01;

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

/// A number that is whole and not negative.
#[expect(clippy::cast_sign_loss, reason = "times are not negative")]
fn whole(value: f64) -> u64 {
    value as u64
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn of_program(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("other-programs");
    folder.join(name).display().to_string()
}

/// A wall clock that passes midnight 5 s after the first sample.
fn clock(t_s: f64) -> String {
    let of_day = (86_395.0 + t_s).rem_euclid(86_400.0);
    let (hours, minutes) = ((of_day / 3600.0).floor(), (of_day % 3600.0 / 60.0).floor());
    format!("{hours:02}:{minutes:02}:{:07.4}", of_day % 60.0)
}

#[test]
fn odd_but_legal_tables_hold_the_same_record() {
    let base = Base::new();
    let plain = base.plain();
    let german = |value: f64, digits: usize| format!("{value:.digits$}").replace('.', ",");
    let utf16: Vec<u8> = std::iter::once(0xfeff)
        .chain(plain.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    let latin = base.lines("t_s,position_\u{b5}m,force_N\n", |_, [t, x, f]| {
        format!("{t:.4},{:.2},{f:.6}", 1e6 * x)
    });
    let latin: Vec<u8> = latin.chars().filter_map(|letter| u8::try_from(letter).ok()).collect();
    let in_units = |heading: &str, [unit_t, unit_x, unit_f]: [f64; 3]| {
        base.lines(heading, |_, [t, x, f]| {
            format!("{:.6},{:.6},{:.8}", t / unit_t, x / unit_x, f / unit_f)
        })
    };
    let tables: Vec<(&str, Vec<u8>)> = vec![
        ("tabs.tsv", plain.replace(',', "\t").into()),
        ("crlf.csv", plain.replace('\n', "\r\n").into()),
        ("cr.csv", plain.replace('\n', "\r").into()),
        ("bom.csv", format!("\u{feff}{plain}").into()),
        ("utf16.csv", utf16),
        ("latin1.csv", latin),
        ("quoted.csv", {
            let quoted = |line: &str| format!("\"{}\"\n", line.replace(',', "\",\""));
            plain.lines().map(quoted).collect::<String>().into()
        }),
        (
            "trailing-commas.csv",
            plain.replace('\n', ",\n").replacen(",\n", "\n", 1).into(),
        ),
        (
            "remarks.csv",
            format!("% bench 3\n# probe 7\nRate: 100 Hz\n\n{plain}").into(),
        ),
        (
            "german.csv",
            base.lines("Zeit (s);Weg [mm];Kraft (N)\n", |_, [t, x, f]| {
                format!("{};{};{}", german(t, 4), german(1e3 * x, 4), german(f, 6))
            })
            .into(),
        ),
        (
            "units-row.csv",
            in_units("time,position,force\ns,mm,mN\n", [1.0, 1e-3, 1e-3]).into(),
        ),
        (
            "suffixes.csv",
            in_units("time_ms,position_um,force_mN\n", [1e-3, 1e-6, 1e-3]).into(),
        ),
        ("gram-force.csv", base.of_force("force_gf", 9.806_65e-3).into()),
        ("kilogram-force.csv", base.of_force("load [kgf]", 9.806_65).into()),
        (
            "ounce-force.csv",
            base.of_force("force_ozf", 0.278_013_850_953_781).into(),
        ),
        ("micronewtons.csv", base.of_force("force (\u{b5}N)", 1e-6).into()),
        (
            "midnight.csv",
            base.lines("time,position_m,force_N\n", |_, [t, x, f]| {
                format!("{},{x:.7},{f:.6}", clock(t))
            })
            .into(),
        ),
        (
            "dates.csv",
            base.lines("timestamp,position_m,force_N\n", |_, [t, x, f]| {
                format!(
                    "2024-05-01T11:{:02}:{:07.4}Z,{x:.7},{f:.6}",
                    whole((t / 60.0).floor()),
                    t % 60.0
                )
            })
            .into(),
        ),
        (
            "epoch.csv",
            base.lines("timestamp_ns,position_m,force_N\n", |_, [t, x, f]| {
                format!("{},{x:.7},{f:.6}", 1_714_550_000_000_000_000 + whole((1e9 * t).round()))
            })
            .into(),
        ),
        (
            "other-columns.csv",
            base.lines(
                "valve_V,Force (N),note,Elapsed Time (ms),x [um]\n",
                |index, [t, x, f]| format!("0.{index},{f:.6},ok,{:.3},{:.2}", 1e3 * t, 1e6 * x),
            )
            .into(),
        ),
    ];
    let real = base.put("plain.csv", &plain);
    let same = |path: &str| {
        let said = ctl_offline(&["compare", &real, path, "--json", "--align", "time"]);
        let found: Value = serde_json::from_slice(&said.stdout).expect("JSON");
        let rms = found["force_rms_difference_N"].as_f64().expect("a number");
        assert!(rms < 0.01, "{path}: {found}");
    };
    for (name, bytes) in tables {
        same(&base.put(name, bytes));
    }
    // pandas, with moments, single precision and whole numbers.
    same(&of_program("data-frame.parquet"));
}

#[test]
fn another_rate_a_drifting_clock_and_gaps_are_aligned() {
    let base = Base::new();
    let real = base.put("plain.csv", base.plain());
    // 43.7 Hz by straight lines, on a clock that is 3 s ahead and 200 ppm fast.
    let at = |t: f64| {
        let index = usize::try_from(whole(t / PERIOD_S)).map_or(0, |index| index.min(base.rows.len() - 2));
        let share = t / PERIOD_S - index as f64;
        let between = |place: usize| {
            let (a, b) = (base.rows[index][place], base.rows[index + 1][place]);
            a + share * (b - a)
        };
        (between(1), between(2))
    };
    let mut drifting = "t_s,position_m,force_N\n".to_owned();
    for index in 0..690 {
        let t = f64::from(index) / 43.7;
        let (x, f) = at(t);
        writeln!(drifting, "{:.7},{x:.8},{f:.6}", 3.0 + 1.0002 * t).expect("a string takes it");
    }
    let gaps: String = base
        .plain()
        .lines()
        .enumerate()
        .filter(|(index, _)| *index == 0 || index % 37 != 0 && !(500..540).contains(index))
        .fold(String::new(), |text, (_, line)| text + line + "\n");
    for (name, table, drift_ppm, note) in [
        ("drifting.csv", drifting, Some(200.0), "ppm faster"),
        ("gaps.csv", gaps, None, "gaps in the rendered record"),
    ] {
        let path = base.put(name, table);
        let said = ctl_offline(&["compare", &real, &path, "--json"]);
        let found: Value = serde_json::from_slice(&said.stdout).expect("JSON");
        assert_eq!(found["aligned_by"], "time", "{found}");
        assert!(found["notes"].to_string().contains(note), "{found}");
        if let Some(drift_ppm) = drift_ppm {
            let drift = found["clock_drift_ppm"].as_f64().expect("a drift");
            assert!((drift - drift_ppm).abs() < 40.0, "{found}");
            let interval = &found["intervals"]["clock_drift_ppm"];
            assert!(interval[0].as_f64() < interval[1].as_f64(), "{found}");
        }
    }
}

#[test]
fn what_is_not_known_of_a_table_is_given_by_options() {
    let base = Base::new();
    let volts = base.put("volts.csv", base.of_force("force_V", 4.0));
    let counts = base.put(
        "counts.csv",
        base.lines("t_s,position_counts,force_N\n", |_, [t, x, f]| {
            format!("{t:.4},{:.0},{f:.6}", x / 1e-5)
        }),
    );
    let bare = base.put("bare.csv", base.plain().split_once('\n').expect("a heading").1);
    for arguments in [
        vec![&volts, "--force-gain", "4"],
        vec![&counts, "--position-gain", "1e-5"],
        vec![
            &bare,
            "--time-column",
            "1",
            "--position-column",
            "2",
            "--force-column",
            "3",
        ],
    ] {
        let output = ctl(
            Path::new("/nonexistent"),
            &[&["identify", "--json"], &arguments[..]].concat(),
        );
        let found: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{arguments:?}: {error}: {}", text(&output.stderr)));
        let mass = found["mass_kg"].as_f64().expect("a mass");
        assert!((mass - 1.0).abs() < 0.05, "{arguments:?}: {found}");
    }
    // A motion needs no force.
    let out = base.put("out.csv", "");
    let simulated = |arguments: &[&str]| {
        let begin = ["simulate", "no-friction", "--out", &out, "--force", "--motion"];
        let output = ctl(Path::new("/nonexistent"), &[&begin, arguments].concat());
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        std::fs::read_to_string(&out).expect("rows")
    };
    let plain = simulated(&[&base.put("plain.csv", base.plain())]);
    assert_eq!(
        simulated(&[&bare, "--time-column", "1", "--position-column", "2"]),
        plain
    );
    assert_eq!(
        simulated(&[&base.put("tabs.tsv", base.plain().replace(',', "\t"))]),
        plain
    );
    let late = base.lines("t,x\n", |_, [t, x, _]| format!("{:.1},{x:.7}", 1e3 * t));
    let milliseconds = simulated(&[&base.put("ms.csv", late), "--time-unit", "ms"]);
    assert_eq!(milliseconds.lines().count(), plain.lines().count());
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
    let put = |name: &str, table: String| base.put(name, table);
    let real = put("plain.csv", plain.clone());
    let (tabs, zero) = (
        put("tabs.tsv", plain.replace(',', "\t")),
        put("zero.csv", String::new()),
    );
    let (nan, empty) = (
        put("nan.csv", line(20, "0.18,nan,1")),
        put("empty.csv", line(20, "0.18,0.001,")),
    );
    let (back, short) = (
        put("back.csv", line(20, "0.01,0.001,1")),
        put("short.csv", line(20, "0.18,0.001")),
    );
    let (volts, angle) = (
        put("volts.csv", base.of_force("force_V", 4.0)),
        put("angle.csv", plain.replacen("position_m", "position_deg", 1)),
    );
    let bare = put("bare.csv", plain.split_once('\n').expect("a heading").1.to_owned());
    let json = put("json.json", "[{\"t_s\": 0.0}, {\"t_s\": 0.1}]\n".to_owned());
    let (frame, mcap) = (of_program("data-frame.parquet"), of_program("json.mcap"));
    let out = base.directory.path().join("out.csv").display().to_string();
    let simulate = |path: &str| ["simulate", "no-friction", "--motion", path, "--out", &out].join("\n");
    let refused: Vec<(String, Vec<&str>)> = vec![
        (
            format!("identify\n{volts}"),
            vec!["unit of `force_V`", "--force-gain", "newtons"],
        ),
        (
            format!("identify\n{angle}"),
            vec!["unit of `position_deg`", "--position-gain", "radius"],
        ),
        (
            format!("identify\n{bare}"),
            vec!["no time, no position, no force column among `1,2,3`", "--time-column"],
        ),
        (format!("identify\n{json}"), vec!["no heading with rows of numbers"]),
        (format!("identify\n{zero}"), vec!["is empty"]),
        (
            format!("identify\n{mcap}"),
            vec!["did not write this MCAP file", "CSV and Parquet"],
        ),
        (
            format!("identify\n{frame}\n--force-column\noperator"),
            vec!["`operator`", "text", "numbers expected"],
        ),
        // `compare` has no options for columns.
        (
            format!("compare\n{real}\n{volts}"),
            vec!["unit of `force_V`", "heading"],
        ),
        (
            format!("compare\n{real}\n{bare}"),
            vec!["no time, no position, no force column among `1,2,3`", "heading"],
        ),
        (
            format!("compare\n{real}\n{mcap}"),
            vec!["did not write this MCAP file", "CSV and Parquet"],
        ),
        (simulate(&mcap), vec!["compressed by zstd", "without compression"]),
        (
            simulate(&bare),
            vec!["no time, no position column among `1,2,3`", "--time-column"],
        ),
        (
            simulate(&angle),
            vec!["unit of `position_deg`", "--position-gain", "radius"],
        ),
        (simulate(&json), vec!["no heading with rows of numbers"]),
        (simulate(&zero), vec!["is empty"]),
        // Without the inputs of the servo there is nothing to replay, convert or cut.
        (
            format!("replay\n{real}"),
            vec!["not a recording", "`t_s,position_m,force_N`", "haptic-ctl identify"],
        ),
        (
            format!("replay\n{frame}"),
            vec!["hapticd did not write this Parquet file", "haptic-ctl identify"],
        ),
        (
            format!("recording\ninfo\n{mcap}"),
            vec!["hapticd did not write this MCAP file", "haptic-ctl identify"],
        ),
        (
            format!("recording\nexport\n{frame}\n{out}"),
            vec!["not a recording", "haptic-ctl identify"],
        ),
        (
            format!("recording\ncut\n{tabs}\n{out}\n--from\n1s"),
            vec!["not a recording", "haptic-ctl identify"],
        ),
    ];
    for (arguments, parts) in refused {
        let arguments: Vec<&str> = arguments.split('\n').collect();
        let output = ctl(Path::new("/nonexistent"), &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        for part in parts {
            assert!(said.contains(part), "{arguments:?}: {said} lacks {part}");
        }
        assert!(
            !said.contains("repair"),
            "{arguments:?}: nothing of it can be repaired: {said}"
        );
    }
    assert!(!PathBuf::from(&out).exists());
    // What a row lacks is a gap, and a time that is wrong between its neighbours is left out.
    for (file, part) in [
        (&nan, "1 row lacks a number, the first in line 20"),
        (&empty, "1 row lacks a number, the first in line 20"),
        (&short, "1 row lacks a number, the first in line 20"),
        (&back, "line 20: the time 0.01 s is wrong between its neighbours"),
    ] {
        let told = text(&ctl(Path::new("/nonexistent"), &["identify", file]).stdout);
        assert!(told.contains(part), "{told} lacks {part}");
    }
    for (file, part) in [(&nan, "1 row lacks a number"), (&back, "wrong between its neighbours")] {
        let simulate = simulate(file);
        let told = text(
            &ctl(
                Path::new("/nonexistent"),
                &simulate.split('\n').chain(["--force"]).collect::<Vec<_>>(),
            )
            .stdout,
        );
        assert!(told.contains(part), "{told} lacks {part}");
    }
}

#[test]
fn unreadable_hand_is_refused_at_start() {
    let base = Base::new();
    let degrees = base.put("degrees.csv", base.plain().replacen("position_m", "position_deg", 1));
    let mcap = of_program("json.mcap");
    for (file, part) in [(&degrees, "say so in its heading"), (&mcap, "without compression")] {
        let output: Output = Command::new(binary("hapticd"))
            .args(["--device", "fake", "--hand", &format!("file:{file}")])
            .arg("--socket")
            .arg(base.directory.path().join("control.sock"))
            .output()
            .expect("hapticd runs");
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(part), "{said} lacks {part}");
    }
}
