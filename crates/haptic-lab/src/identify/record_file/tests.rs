//! Files of other laboratories.

use super::*;
use std::path::PathBuf;

fn write(name: &str, text: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join(name);
    std::fs::write(&path, text).expect("written");
    (directory, path)
}

fn read_text(text: &str, change: impl Fn(&mut Source)) -> Result<Loaded, RecordFileError> {
    let (_directory, path) = write("record.csv", text);
    let mut source = Source::new(&path);
    change(&mut source);
    read(&source)
}

/// The message by which a text is refused.
fn refused(text: &str, change: impl Fn(&mut Source)) -> String {
    read_text(text, change).expect_err(text).to_string()
}

/// Positions of one file and forces of another.
fn read_two(path: &Path, force_path: PathBuf) -> Result<Loaded, RecordFileError> {
    read(&Source {
        force_path: Some(force_path),
        ..Source::new(path)
    })
}

fn named(source: &mut Source, names: [&str; 3]) {
    let [time, position, force] = names.map(|name| Some(name.to_owned()));
    let columns = &mut source.table.columns;
    (columns.time, columns.position, columns.force) = (time, position, force);
}

#[track_caller]
fn assert_says(loaded: &Loaded, part: &str) {
    let mut notes = loaded.notes.iter();
    assert!(notes.any(|note| note.contains(part)), "{:?}", loaded.notes);
}

#[test]
fn a_table_of_any_program_is_read_by_its_names_and_units() {
    for text in [
        "t_s,position_m,force_N,pulse_N\n1.5,0.25,-3,x\n",
        "# a remark\n\n\"Time (s)\";\"Position [m]\";Force [N]\n1,5;0,25;-3\n",
        "time\tpos\tF\n1.5\t0.25\t-3\n",
        "  t   x   f\n 1.5  0.25 -3\n",
        "t x F\n1,5 0,25 -3,0\n",
        "\u{feff}Force (N),Time (ms),Position (mm)\r\n-3,1500,250\r\n",
        "Device: probe 7\nRate: 1000 Hz\n\nTime;Position;Force\ns;mm;kN\n1,5;250;-0,003\n",
        "% made by hand\n// twice\nTime\tPosition\tForce\n[ms]\t[um]\t[mN]\n1500\t250000\t-3000\n",
        "time,position,force\n00:00:01.5,0.25,-3\n",
        "time,position,force\n\"2024-05-01 00:00:01.5\",\"0,25\",\"-3,0\"\n",
    ] {
        let loaded = read_text(text, |_| {}).unwrap_or_else(|error| panic!("{text}: {error}"));
        let record = &loaded.record;
        let (t, x, f) = (record.t_s[0], record.position_m[0], record.force_n[0]);
        assert!(
            (t - 1.5).abs() < 1e-9 && (x - 0.25).abs() < 1e-12 && (f + 3.0).abs() < 1e-12,
            "{text}: {t} {x} {f}"
        );
        assert!(record.velocity_mps.is_none() && loaded.offset_n.is_none());
    }
}

#[test]
fn gains_and_names_say_what_a_column_is() {
    let loaded = read_text("clock,encoder,cell,force\n0,4000,2,9\n0.001,4001,2.5,9\n", |source| {
        named(source, ["clock", "encoder", "cell"]);
        source.table.position_gain = Some(-1e-5);
        source.table.force_gain = Some(35.15);
    })
    .expect("a record");
    assert!((loaded.record.position_m[0] + 0.04).abs() < 1e-12);
    assert!((loaded.record.force_n[1] - 87.875).abs() < 1e-9);
}

#[test]
fn the_unit_in_a_name_counts_unless_a_gain_says_otherwise() {
    let text = "Zeit (ms);Weg [mm];load_kN\n0;4,5;0,002\n1;4,6;0,002\n";
    let read = |position_gain| {
        let loaded = read_text(text, |source| {
            named(source, ["Zeit (ms)", "Weg [mm]", "load_kN"]);
            source.table.position_gain = position_gain;
        });
        let Loaded { record, notes, .. } = loaded.expect("a record");
        assert!(notes[0].contains("load_kN (x 1000)"), "{notes:?}");
        assert!((record.t_s[1] - 1e-3).abs() < 1e-15 && (record.force_n[0] - 2.0).abs() < 1e-12);
        record.position_m[0]
    };
    assert!((read(None) - 4.5e-3).abs() < 1e-15);
    assert!((read(Some(1e-3)) - 4.5e-3).abs() < 1e-15);
    assert!((read(Some(-2e-3)) + 9e-3).abs() < 1e-15);
}

#[test]
fn a_bad_file_or_option_is_refused_by_its_place() {
    for (text, parts) in [
        (
            "a,b\n1,2\n",
            vec!["no time, no position, no force column", "`a,b`", "--time-column", "t_s"],
        ),
        ("t,x\n1,2\n", vec!["no force column", "--force-column"]),
        ("t,x,f\n0,1,2\n1,one,2\n", vec!["line 3", "x = `one`"]),
        ("t,x,f\n0,1,2\n1,nan,2\n", vec!["line 3", "x = `nan`"]),
        ("t,x,f\n0,1,2\n1,2\n", vec!["line 3", "2 cells", "none for f"]),
        ("t,x,f\n1,1,2\n0,2,3\n", vec!["line 3", "back from 1 s to 0 s"]),
        (
            "t,x,f,f\n1,1,2,3\n",
            vec!["which is the force of `f` (column 3), `f` (column 4)", "--force-column"],
        ),
        ("t,x,f\n", vec!["no heading with rows"]),
        ("0,1,2\n1,2,3\n", vec!["no heading"]),
        ("", vec!["is empty"]),
    ] {
        let message = refused(text, |_| {});
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
    let message = refused("t,x,f\n0,1,2\n", |source| source.table.force_gain = Some(0.0));
    assert!(message.contains("--force-gain = 0"), "{message}");
    let message = refused("t,x,f\n0,1,2\n", |source| source.moving = MovingMass::Device);
    assert!(message.contains("--moving"), "{message}");
}

#[test]
fn repeated_times_are_left_out_and_reported() {
    let loaded = read_text("t_s,x,f\n0,1,2\n0,1,2\n1,2,3\n", |_| {}).expect("a record");
    assert_eq!(loaded.record.t_s, [0.0, 1.0]);
    assert_says(&loaded, "1 rows repeat");
}

#[test]
fn forces_come_from_another_file_with_its_own_rate_and_clock() {
    let positions: String = (0..3000).map(|k| format!("{},{}\n", f64::from(k) * 1e-3, k)).collect();
    let forces: String = (0..300)
        .map(|k| format!("{},{}\n", 1000.0 + f64::from(k) * 1e-2, k))
        .collect();
    let (_one, path) = write("positions.csv", format!("t,x\n{positions}"));
    let (_other, force_path) = write("forces.csv", format!("t,f\n{forces}"));
    let loaded = read_two(&path, force_path).expect("a record");
    let record = &loaded.record;
    assert_eq!(record.t_s.len(), record.force_n.len());
    assert!((record.force_n[1005] - 100.5).abs() < 1e-9, "{}", record.force_n[1005]);
    assert_says(&loaded, "no time in common");
}

/// The path of a file of these rows of 20 s at 1 kHz.
fn rows_of(
    folder: &std::path::Path,
    title: &str,
    rows: impl Iterator<Item = u32>,
    row: impl Fn(u32) -> String,
) -> PathBuf {
    let path = folder.join(format!("{title}.csv"));
    let text: String = rows.map(|k| format!("{}\n", row(k))).collect();
    std::fs::write(&path, format!("{title}\n{text}")).expect("written");
    path
}

#[test]
fn gaps_of_the_forces_are_those_of_one_file() {
    let folder = tempfile::tempdir().expect("a directory");
    let t = |k: u32| f64::from(k) * 1e-3;
    let (x, f) = (|k: u32| 0.02 * (3.0 * t(k)).sin(), |k: u32| 2.0 * (3.0 * t(k)).cos());
    let outside = || (0..20_000).filter(|k| !(8000..12_000).contains(k));
    let one = rows_of(folder.path(), "t_s,x,f", outside(), |k| {
        format!("{},{},{}", t(k), x(k), f(k))
    });
    let path = rows_of(folder.path(), "t_s,x", 0..20_000, |k| format!("{},{}", t(k), x(k)));
    let forces = rows_of(folder.path(), "t_s,f", outside(), |k| format!("{},{}", t(k), f(k)));
    let together = read(&Source::new(&one)).expect("a record").record;
    let apart = read_two(&path, forces).expect("a record");
    assert_eq!(apart.record.t_s, together.t_s);
    assert_eq!(apart.record.position_m, together.position_m);
    for (apart_n, together_n) in apart.record.force_n.iter().zip(&together.force_n) {
        assert!((apart_n - together_n).abs() < 1e-12, "{apart_n} N, {together_n} N");
    }
    assert_says(&apart, "4000 rows lie in gaps of");
}

#[test]
fn two_takes_are_not_laid_over_another_file() {
    let folder = tempfile::tempdir().expect("a directory");
    let (steady, takes) = (|k: u32| f64::from(k) * 1e-3, |k: u32| f64::from(k % 5000) * 1e-3);
    type Clock = fn(u32) -> f64;
    let file = |title, t: Clock| rows_of(folder.path(), title, 0..10_000, |k| format!("{},{k}", t(k)));
    let cases: [(Clock, Clock, &str); 2] = [
        (steady, takes, "t_s,f.csv, line 5002: the clock falls back"),
        (takes, steady, "t_s,x.csv, line 5002: the clock"),
    ];
    for (of_positions, of_forces, place) in cases {
        let (path, force_path) = (file("t_s,x", of_positions), file("t_s,f", of_forces));
        let error = read_two(&path, force_path).expect_err("two takes").to_string();
        assert!(error.contains(place), "{error}");
    }
}

#[test]
fn the_columns_of_a_binary_recording_cannot_be_named() {
    let (_folder, path) = write("r.mcap", b"\x89MCAP0\r\n");
    let mut source = Source::new(&path);
    source.table.columns.force = Some("command_force_N".to_owned());
    let message = read(&source).expect_err("no table").to_string();
    assert!(
        message.contains("MCAP or Parquet") && message.contains("recording export"),
        "{message}"
    );
}

#[test]
fn a_velocity_in_other_units_is_reported() {
    let rows: String = (0..100)
        .map(|k| format!("{},{},{},1\n", f64::from(k) * 1e-3, f64::from(k) * 2e-3, 2000.0))
        .collect();
    let loaded = read_text(&format!("t,x,v,f\n{rows}"), |_| {}).expect("a record");
    assert_says(&loaded, "1000.0000 times");
}

#[test]
fn the_headings_of_a_file_are_known_before_it_is_read() {
    let (_directory, path) = write(
        "record.csv",
        "\u{feff}# a remark\n\n\"Zeit (s)\";\"Weg [mm]\";Kraft\n1,5;0,25;-3\n",
    );
    let names = ["Zeit (s)", "Weg [mm]", "Kraft"].map(str::to_owned).to_vec();
    assert_eq!(headings(&path).expect("a heading"), Some(names));
    let (_directory, path) = write("recording.csv", "# hapticd recording 1\n");
    assert_eq!(headings(&path).expect("a recording"), None, "its columns are known");
    let (_directory, path) = write("empty.csv", "# a remark\n");
    assert!(headings(&path).is_err_and(|error| error.to_string().contains("no heading")));
}

#[test]
fn recording_of_two_axes_is_refused() {
    let (_directory, path) = write("plane.csv", "");
    let about = serde_json::json!({
        "server": "hapticd", "device": "fake rig", "loop_rate_hz": 1000.0, "rate_hz": 1000.0, "started_unix_s": 0.0,
        "revision": 1, "scene": haptic_core::Scene::paper(),
    });
    let mut about: haptic_recording::Metadata = serde_json::from_value(about).expect("metadata");
    about.axes = 2;
    let mut writer = haptic_recording::Writer::create(&path, &about, true).expect("begun");
    let (row, y) = (haptic_ipc::Sample::default(), haptic_ipc::SampleY::default());
    writer.rows(&[row], &[y]).expect("written");
    writer.finish().expect("written");
    let error = read(&Source::new(&path)).expect_err("two axes").to_string();
    assert!(error.contains("plane.csv") && error.contains("two axes"), "{error}");
    let recording = haptic_recording::open_any(&path).and_then(haptic_recording::Reader::into_recording);
    let error = take(&recording.expect("it reads"), &Source::new(&path)).expect_err("two axes");
    assert!(error.to_string().contains("two axes"));
}

#[test]
fn a_unit_that_is_not_known_wants_a_gain() {
    let text = "t,x,bridge (mV/V)\n0,1,2\n";
    let read = |force_gain| {
        read_text(text, |source| {
            source.table.columns.force = Some("bridge (mV/V)".to_owned());
            source.table.force_gain = force_gain;
        })
    };
    let message = read(None).expect_err("no unit of force").to_string();
    assert!(
        message.contains("`bridge (mV/V)`") && message.contains("--force-gain"),
        "{message}"
    );
    assert!((read(Some(50.0)).expect("a record").record.force_n[0] - 100.0).abs() < 1e-12);
}

/// A motion in rows of text, with a change of each.
fn motion(row: impl Fn(usize, f64, f64, f64) -> String) -> String {
    (0..400)
        .map(|k| {
            let t_s = k as f64 * 4e-3;
            row(k, t_s, 0.02 * (6.0 * t_s).sin(), 2.0 * (6.0 * t_s).cos())
        })
        .collect()
}

#[test]
fn foreign_extras_leave_the_motion_unchanged() {
    let plain = motion(|_, t, x, f| format!("{t:.4},{x:.6},{f:.4}\n"));
    let truth = read_text(&format!("t_s,position_m,force_N\n{plain}"), |_| {}).expect("a record");
    assert_says(&truth, "400 rows, 250.00000 Hz, 1.596 s");
    for (what, text) in [
        ("a last row that is torn", format!("t_s,position_m,force_N\n{plain}1.6")),
        (
            "a velocity that was not measured",
            format!(
                "t_s,position_m,velocity_mps,force_N\n{}",
                motion(|_, t, x, f| format!("{t:.4},{x:.6},nan,{f:.4}\n"))
            ),
        ),
        (
            "voltages and positions by other names beside",
            format!(
                "T,time_s,f,Force (V),Force (N),x,position_m\n{}",
                motion(|k, t, x, f| format!("{k},{t:.4},7,{},{f:.4},5,{x:.6}\n", 0.5 * f))
            ),
        ),
    ] {
        let read = read_text(&text, |_| {}).unwrap_or_else(|error| panic!("{what}: {error}"));
        let columns = |loaded: &Loaded| {
            let record = loaded.record.clone();
            [record.t_s, record.position_m, record.force_n]
        };
        assert_eq!(columns(&read), columns(&truth), "{what}: {:?}", read.notes);
    }
}

#[test]
fn times_without_a_unit_are_seconds_only_where_they_can_be() {
    let text = |unit: &str| {
        let rows = motion(|k, _, x, f| format!("{},{x:.6},{f:.4}\n", 1_700_000_000_000_u64 + 4 * k as u64));
        format!("time{unit},position_m,force_N\n{rows}")
    };
    let message = refused(&text(""), |_| {});
    assert!(
        message.contains("--time-unit") && message.contains("4 s apart"),
        "{message}"
    );
    // A colon in another column makes no time of day of the times.
    for (title, cell) in [("timestamp", "2026-05-01 12:00:00.001"), ("remark", "a:b")] {
        let rows = motion(|k, _, x, f| format!("{k},{x:.6},{f:.4},{cell}\n"));
        let message = refused(&format!("time,position,force,{title}\n{rows}"), |_| {});
        assert!(message.contains("--time-unit"), "{message}");
    }
    for (unit, time_unit_s) in [("_ms", None), ("", Some(1e-3))] {
        let loaded = read_text(&text(unit), |source| source.table.time_unit_s = time_unit_s).expect("a record");
        let t_s = &loaded.record.t_s;
        assert!((t_s[399] - t_s[0] - 1.596).abs() < 1e-6, "{unit}");
    }
}
