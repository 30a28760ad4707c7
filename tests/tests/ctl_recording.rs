//! `haptic-ctl recording`, and recordings as motions.

use haptic_ipc::RigState;
use haptic_recording::{Ending, Mark, Recording};
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use system_tests::{Daemon, binary, until};

/// The endings of the formats.
const ENDINGS: [&str; 3] = ["mcap", "csv", "parquet"];

fn read(file: &Path) -> Recording {
    haptic_recording::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn offline(arguments: &[&str]) -> Output {
    system_tests::ctl(Path::new("/nonexistent"), arguments)
}

fn offline_ok(arguments: &[&str]) -> String {
    text(&system_tests::ctl_offline(arguments).stdout)
}

/// Fails with exit code 2, and with such parts in the message.
fn refused(arguments: &[&str], parts: &[&str]) {
    let output = offline(arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    for part in parts {
        assert!(said.contains(part), "{arguments:?}: `{said}` lacks `{part}`");
    }
}

fn plain(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// A folder with recordings in it.
struct Shelf {
    folder: tempfile::TempDir,
}

impl Shelf {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a directory"),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A recording of two scenes and the way to force, with a marker before and one after each change.
    fn session(&self) -> PathBuf {
        let daemon = Daemon::start(&["--ramp-ms", "10"]);
        let file = self.path("session.csv");
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
        let pid = rustix::process::Pid::from_child(&recorder);
        rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
        assert!(recorder.wait().expect("it ends").success());
        file
    }

    /// The same recording in every format.
    fn in_every_format(&self, file: &Path) -> Vec<PathBuf> {
        let export = |ending: &&str| {
            let out = self.path(&format!("exported.{ending}"));
            offline_ok(&["recording", "export", plain(file), plain(&out)]);
            out
        };
        ENDINGS.iter().map(export).collect()
    }
}

#[test]
fn info_tells_what_a_recording_holds_in_every_format() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let found = read(&file);
    for file in shelf.in_every_format(&file) {
        let told: Value =
            serde_json::from_str(&offline_ok(&["recording", "info", plain(&file), "--json"])).expect("JSON");
        assert_eq!(told["rows"], found.rows.len());
        let [first, last] = [0, found.rows.len() - 1].map(|index| found.rows[index]);
        assert_eq!(told["ticks"], serde_json::json!([first.tick, last.tick]));
        assert_eq!(told["length_s"], last.t_s - first.t_s);
        assert_eq!(
            (&told["complete"], &told["notes"]),
            (&true.into(), &"two scenes".into())
        );
        assert_eq!(
            told["format"],
            file.extension().and_then(|ending| ending.to_str()).expect("one")
        );
        let events: Vec<(String, String)> = told["events"]
            .as_array()
            .expect("a list")
            .iter()
            .map(|event| {
                let what = ["text", "state", "revision"].iter().find_map(|name| event.get(name));
                (
                    event["kind"].as_str().expect("text").to_owned(),
                    what.expect("one").to_string(),
                )
            })
            .collect();
        // On a busy machine what a person does and what the daemon tells may come in another order.
        for kind in ["state", "scene", "marker"] {
            let found: Vec<&str> = events
                .iter()
                .filter(|(found, _)| found == kind)
                .map(|(_, what)| what.as_str())
                .collect();
            let wanted = match kind {
                "state" => vec!["\"idle\"", "\"engaging\"", "\"engaged\""],
                "scene" => vec!["2"],
                _ => vec!["\"first\"", "\"second\"", "\"third\""],
            };
            assert_eq!(found, wanted, "{events:?}");
        }
        for event in told["events"].as_array().expect("a list") {
            let (tick, t_s) = (
                event["tick"].as_u64().expect("a tick"),
                event["t_s"].as_f64().expect("a time"),
            );
            let at = found.rows.iter().find(|row| row.tick >= tick).unwrap_or(&last);
            assert!((at.t_s - first.t_s - t_s).abs() < 0.05, "{event}");
        }
        let told = offline_ok(&["recording", "info", plain(&file)]);
        for part in [
            "two scenes",
            "marker",
            "third",
            "engaged",
            "revision 2",
            "every tick",
            "complete",
        ] {
            assert!(told.contains(part), "{told} lacks {part}");
        }
    }
    refused(
        &["recording", "info", "/nowhere.mcap"],
        &["/nowhere.mcap", "No such file"],
    );
    let other = shelf.path("other.csv");
    std::fs::write(&other, "t_s,position_m\n0,0\n").expect("written");
    refused(&["recording", "info", plain(&other)], &["other.csv", "not a recording"]);
}

#[test]
fn a_recording_is_the_same_in_every_format_and_back() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let found = read(&file);
    assert!(found.rows.len() > 10 && found.marks.len() > 6, "{:?}", found.marks);
    for exported in shelf.in_every_format(&file) {
        assert_eq!(read(&exported), found, "{}", exported.display());
        let back = shelf.path("back.csv");
        offline_ok(&["recording", "export", plain(&exported), plain(&back), "--force"]);
        let bytes = [&file, &back].map(|file| std::fs::read(file).expect("it is there"));
        assert!(bytes[0] == bytes[1], "{} and back", exported.display());
    }
}

#[test]
fn nothing_is_replaced_that_was_not_to_be() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let (path, kept) = (plain(&file), std::fs::read(&file).expect("it is there"));
    for command in ["export", "repair", "cut"] {
        refused(&["recording", command, path, path], &["session.csv exists", "--force"]);
        let other = shelf.path("other.csv");
        std::fs::write(&other, "mine").expect("written");
        refused(
            &["recording", command, path, plain(&other)],
            &["other.csv exists", "--force"],
        );
        assert_eq!(std::fs::read(&other).expect("it is there"), b"mine");
        offline_ok(&["recording", command, path, plain(&other), "--force"]);
        assert_eq!(read(&other).rows.len(), read(&file).rows.len());
        let nameless = shelf.path("other.txt");
        refused(
            &["recording", command, path, plain(&nameless)],
            &[".mcap", ".csv", ".parquet"],
        );
        assert!(!nameless.exists());
    }
    assert_eq!(std::fs::read(&file).expect("it is there"), kept);
}

#[test]
fn cut_part_begins_with_state_of_its_first_row() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let (path, whole) = (plain(&file), read(&file));
    let begin_s = whole.rows[0].t_s;
    let place = |text: &str| {
        let is_it = |(_, mark): &&(usize, Mark)| matches!(mark, Mark::Marker { text: found, .. } if found == text);
        whole.marks.iter().find(is_it).expect("a marker").0
    };
    let is_state = |(_, mark): &&(usize, Mark)| matches!(mark, Mark::State { .. });
    let first_state = whole.marks.iter().find(is_state).expect("a state").0;
    let out = shelf.path("part.csv");
    for (arguments, rows) in [
        (
            vec!["--from-marker", "second", "--to-marker", "third"],
            place("second")..place("third"),
        ),
        (vec!["--from-marker", "second"], place("second")..whole.rows.len()),
        (vec!["--to-marker", "second"], 0..place("second")),
        (
            vec!["--from", "3ms", "--to", "12ms"],
            whole.rows.partition_point(|row| row.t_s - begin_s < 0.003 - 5e-6)
                ..whole.rows.partition_point(|row| row.t_s - begin_s < 0.012 - 5e-6),
        ),
        (vec![], 0..whole.rows.len()),
    ] {
        let told = offline_ok(
            &[
                &["recording", "cut", path, plain(&out), "--force", "--json"],
                &arguments[..],
            ]
            .concat(),
        );
        let told: Value = serde_json::from_str(&told).expect("JSON");
        let part = read(&out);
        assert_eq!(part.rows, whole.rows[rows.clone()], "{arguments:?}");
        assert_eq!(told["rows"], rows.len());
        assert_eq!(part.ending, Ending::Complete);
        let first = part.rows[0];
        // A marker may have the very tick at which the scene came: then a mark before the first row says it.
        let came = part.marks.iter().find_map(|(row, mark)| match mark {
            Mark::Scene {
                revision,
                arrival: Some(arrival),
                ..
            } if *row == 0 => Some((*revision, &arrival.scene)),
            _ => None,
        });
        let (revision, scene) = came.unwrap_or((part.metadata.revision, &part.metadata.scene));
        assert_eq!(revision, first.revision, "{arguments:?}");
        let mass = scene.block.as_ref().expect("a block").mass;
        assert_eq!(mass == 1.5, first.revision == 2, "{arguments:?}");
        let state = part.marks.iter().find_map(|(row, mark)| match mark {
            Mark::State { state, .. } => Some((*row, *state)),
            _ => None,
        });
        // That of the whole recording is told some ticks after its first row.
        match state {
            Some((0, state)) => assert_eq!(state, first.state, "{arguments:?}"),
            _ => assert!(rows.start <= first_state, "{arguments:?}: {state:?}"),
        }
    }
    for (arguments, parts) in [
        (
            vec!["--from-marker", "fourth"],
            vec!["no marker `fourth`", "`first`, `second`, `third`"],
        ),
        (vec!["--from", "1h"], vec!["none of its", "is within the cut"]),
        (
            vec!["--from", "2s", "--to", "1s"],
            vec!["ends at 1.000 s", "begins at 2.000 s"],
        ),
        (
            vec!["--from-marker", "third", "--to-marker", "first"],
            vec!["the end must come after"],
        ),
        (
            vec!["--from", "2s", "--from-marker", "first"],
            vec!["cannot be used with"],
        ),
    ] {
        let nothing = shelf.path("nothing.csv");
        refused(
            &[&["recording", "cut", path, plain(&nothing)], &arguments[..]].concat(),
            &parts,
        );
        assert!(!nothing.exists(), "{arguments:?}");
    }
}

#[test]
fn what_can_be_read_is_kept_by_a_repair() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let whole = read(&file);
    let csv = std::fs::read_to_string(&file).expect("text");
    let lines: Vec<&str> = csv.lines().collect();
    let half = (lines.len() / 2..)
        .find(|index| !lines[*index].starts_with('#'))
        .expect("a row");
    let before: usize = lines[..half].iter().map(|line| line.len() + 1).sum();
    let (broken, out) = (shelf.path("broken.csv"), shelf.path("repaired.csv"));
    let repair = |damaged: &str| {
        std::fs::write(&broken, damaged).expect("written");
        let told = offline_ok(&["recording", "repair", plain(&broken), plain(&out), "--force", "--json"]);
        let told: Value = serde_json::from_str(&told).expect("JSON");
        let found = read(&out);
        assert_eq!(found.ending, Ending::Complete);
        assert_eq!(told["rows"], found.rows.len());
        (found, told)
    };

    let (found, told) = repair(&format!("{}x{}", &csv[..before], &csv[before..]));
    assert_eq!(found.rows.len(), whole.rows.len() - 1);
    assert!(told["dropped_bytes"].as_u64().is_some_and(|bytes| bytes > 50), "{told}");
    assert!(
        found.marks.iter().any(|(_, mark)| *mark == Mark::Lost { rows: 1 }),
        "{told}"
    );
    let exported = shelf.path("exported.csv");
    refused(
        &["recording", "export", plain(&broken), plain(&exported)],
        &["broken.csv", "is not a row", "recording repair"],
    );
    assert!(!exported.exists(), "half of a recording is not one");
    for reads in [&["recording", "info"][..], &["identify"]] {
        refused(
            &[reads, &[plain(&broken)]].concat(),
            &["broken.csv", "is not a row", "recording repair"],
        );
    }
    let replayed = offline(&["replay", plain(&broken)]);
    let told = String::from_utf8_lossy(&replayed.stderr);
    assert!(
        replayed.status.code() == Some(1) && told.contains("recording repair"),
        "{told}"
    );

    for (length, ending) in [(before + 10, "broken off"), (before, "without an end")] {
        let (found, told) = repair(&csv[..length]);
        assert_eq!(found.rows, whole.rows[..found.rows.len()]);
        assert!(
            found.rows.len() + 20 > whole.rows.len() / 2,
            "{} rows",
            found.rows.len()
        );
        assert!(
            told["ending_before"].as_str().is_some_and(|told| told.contains(ending)),
            "{told}"
        );
    }
}

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");

#[test]
fn recording_in_any_format_drives_simulate_and_hand() {
    let shelf = Shelf::new();
    let file = shelf.session();
    let whole = read(&file);
    let plain_table = shelf.path("table.csv");
    let rows: String = whole
        .rows
        .iter()
        .map(|row| {
            format!(
                "{},{},0.5,{}\n",
                row.t_s, row.device_position_m, row.device_velocity_mps
            )
        })
        .collect();
    std::fs::write(&plain_table, format!("t_s,position_m,force_N,velocity_mps\n{rows}")).expect("written");
    let mut forces = Vec::new();
    for motion in shelf.in_every_format(&file).iter().chain([&plain_table]) {
        let out = shelf.path("out.csv");
        let told = offline_ok(&[
            "simulate",
            SCENE,
            "--motion",
            plain(motion),
            "--out",
            plain(&out),
            "--force",
        ]);
        assert!(told.contains(&format!("{} ticks", whole.rows.len() - 1)), "{told}");
        forces.push(std::fs::read_to_string(&out).expect("rows"));
        assert_eq!(forces.last(), forces.first(), "{}", motion.display());

        let daemon = Daemon::start(&["--hand", &format!("file:{}", motion.display())]);
        let status = system_tests::status(&mut daemon.client());
        let device = status.device.description;
        let wanted = format!("{} ({} samples", motion.display(), whole.rows.len());
        assert!(device.contains(&wanted), "`{device}` lacks `{wanted}`");
        assert_eq!(status.state, RigState::Idle);
    }
}
