//! Recordings that are made from others, of two axes but for one test: what is copied of one is copied of the other.

use super::plane::{about, y};
use super::*;
use haptic_ipc::{SceneArrival, SceneRamp};
use std::path::PathBuf;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a directory"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a recording that was ended, or not.
    fn write(&self, name: &str, entries: &[Entry], is_complete: bool) -> PathBuf {
        let path = self.path(name);
        let mut writer = Writer::create(&path, &about(), false).expect("begun");
        for entry in entries {
            writer.entry(entry).expect("written");
        }
        let end = if is_complete {
            writer.finish()
        } else {
            writer.break_off()
        };
        end.expect("written");
        path
    }

    fn names(&self) -> Vec<String> {
        let listed = std::fs::read_dir(self.0.path()).expect("it is there");
        let mut names: Vec<String> = listed
            .map(|entry| entry.expect("reads").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

fn read(path: &Path) -> Result<Recording, RecordingError> {
    open_any(path)?.into_recording()
}

fn scene_mark(tick: u64, revision: u64, arrival: SceneArrival) -> Mark {
    Mark::Scene {
        tick,
        revision,
        name: format!("scene {revision}"),
        law: "karnopp".into(),
        params: haptic_ipc::params_of(&scene()),
        arrival: Some(Box::new(arrival)),
    }
}

fn named(revision: u64) -> Scene {
    Scene {
        name: format!("scene {revision}"),
        ..scene()
    }
}

/// Ticks 1 to 1000, with two scenes, of which the second has a ramp of 100 ms, and a stop.
fn session() -> Vec<Entry> {
    let state = |tick, state| Mark::State {
        tick,
        state,
        fault: None,
    };
    let at_once = |revision| SceneArrival {
        scene: named(revision),
        ramp: None,
    };
    let ramp = SceneRamp {
        from: named(8),
        over_s: 0.1,
    };
    let in_time = SceneArrival {
        ramp: Some(ramp),
        ..at_once(9)
    };
    let marks = [
        (1, state(1, RigState::Engaged)),
        (300, scene_mark(300, 8, at_once(8))),
        (500, scene_mark(500, 9, in_time)),
        (700, state(700, RigState::Stopped)),
        (800, Mark::Lost { rows: 3 }),
    ];
    (1..=1000)
        .flat_map(|tick| {
            let here = marks.iter().filter(move |(at, _)| *at == tick);
            here.map(|(_, mark)| Entry::Mark(mark.clone()))
                .chain([Entry::Row(sample(tick), Some(y(tick)))])
        })
        .collect()
}

#[test]
fn an_export_holds_the_same_and_replaces_nothing() {
    let folder = Folder::new();
    let first = folder.write("first.csv", &session(), false);
    let wanted = read(&first).expect("reads");
    let mut from = first;
    for name in ["copy.parquet", "copy.mcap", "copy.csv"] {
        let to = folder.path(name);
        let totals = export(&from, &to, false).expect("exported");
        assert_eq!((totals.rows, totals.lost), (1000, 3));
        assert_eq!(read(&to).expect("reads"), wanted, "{name}");
        from = to;
    }
    let there = folder.path("first.csv");
    let error = export(&from, &there, false).expect_err("it is there");
    assert!(error.to_string().contains("first.csv"), "{error}");
    let error = export(&folder.path("none.csv"), &there, true).expect_err("there is nothing");
    assert_eq!(error.to_string().matches("none.csv").count(), 1, "{error}");
    assert_eq!(read(&there).expect("it is as it was"), wanted);
    assert_eq!(folder.names().len(), 4, "nothing is left beside: {:?}", folder.names());
}

#[test]
fn a_repair_keeps_every_row_that_is_whole() {
    let folder = Folder::new();
    for name in ["r.csv", "r.mcap"] {
        let path = folder.write(name, &session(), true);
        let whole = std::fs::read(&path).expect("it is there");
        // Torn in the last row.
        let row = [&[0, 1, 0, 0][..], &1000_u64.to_le_bytes()].concat();
        let is_row = |bytes: &[u8]| bytes == row || bytes[..6] == *b"\n1000,";
        let torn = whole.windows(12).rposition(is_row).expect("a row") + 21;
        std::fs::write(&path, &whole[..torn]).expect("written");
        let repaired = repair(&path, &path, true).expect("repaired");
        assert_eq!(repaired.totals.rows, 999, "{name}");
        let dropped = repaired.dropped_bytes;
        assert!((20..80).contains(&dropped), "{name}: {dropped}");
        assert!(matches!(repaired.ending, Ending::BrokenOff { .. }), "{name}");
        let found = read(&path).expect("whole");
        assert_eq!(found.ending, Ending::Complete);
        let last = &found.marks[found.marks.len() - 2].1;
        let is_told = matches!(last, Mark::Marker { tick: 999, text } if text.contains("broken off"));
        assert!(is_told, "{last:?}");
        assert_eq!(found.rows.last().map(|row| row.tick), Some(999));
        assert_eq!(found.rows_y.last(), Some(&y(999)));
    }
    assert_eq!(folder.names(), ["r.csv", "r.mcap"]);
}

#[test]
fn a_repair_passes_over_damage_and_marks_what_is_lost() {
    let folder = Folder::new();
    for (name, lost, dropped) in [("r.csv", 1, 40..200), ("r.mcap", 250, 55_000..65_000)] {
        let path = folder.write(name, &session(), true);
        let mut bytes = std::fs::read(&path).expect("it is there");
        let row = 400_u64.to_le_bytes();
        let is_row = |bytes: &[u8]| bytes == row || bytes[..5] == *b"\n400,";
        let place = bytes.windows(8).position(is_row).expect("a row");
        // In the tick of CSV, behind that of MCAP.
        let within = if bytes[place] == b'\n' { 3 } else { 8 };
        bytes[place + within] = b'x';
        std::fs::write(&path, bytes).expect("written");
        drop(read(&path).expect_err("damaged"));
        let repaired = repair(&path, &folder.path(&format!("whole {name}")), false).expect("repaired");
        let (totals, bytes) = (repaired.totals, repaired.dropped_bytes);
        assert_eq!((totals.rows, totals.lost), (1000 - lost, 3 + lost), "{name}");
        assert!(dropped.contains(&bytes), "{name}: {bytes}");
        assert_eq!(repaired.ending, Ending::Complete);
    }
}

#[test]
fn a_cut_begins_with_the_scene_and_the_state_of_its_moment() {
    let folder = Folder::new();
    let whole = folder.write("r.mcap", &session(), true);
    let part = |name: &str, span: Span| {
        let path = folder.path(name);
        let totals = cut(&whole, &path, &span, true, None).expect("cut");
        let part = read(&path).expect("reads");
        assert_eq!(totals.rows, part.rows.len() as u64);
        assert_eq!(part.ending, Ending::Complete);
        part
    };
    let ticks = |recording: &Recording| (recording.rows[0].tick, recording.rows.last().expect("rows").tick);
    let marks = |recording: &Recording| -> Vec<(usize, Option<u64>)> {
        let marks = recording.marks.iter().map(|(rows, mark)| (*rows, mark.tick()));
        marks.collect()
    };
    let middle = part("middle.csv", Span::Time(0.3995..0.45));
    assert_eq!(ticks(&middle), (401, 450));
    assert_eq!((middle.rows_y[0], middle.rows_y.last()), (y(401), Some(&y(450))));
    assert_eq!((middle.metadata.revision, &middle.metadata.scene), (8, &named(8)));
    assert!((middle.metadata.started_unix_s - metadata().started_unix_s - 0.4).abs() < 1e-6);
    assert_eq!(marks(&middle), [(0, Some(1)), (50, None)]);
    // The scene arrives with the first row.
    let arrival = part("arrival.mcap", Span::Ticks(300..302));
    assert_eq!((ticks(&arrival), arrival.metadata.revision), ((300, 301), 7));
    assert_eq!(marks(&arrival), [(0, Some(1)), (0, Some(300)), (2, None)]);
    // In the middle of a ramp, and after it.
    let ramp = part("ramp.parquet", Span::Ticks(550..552));
    assert_eq!((ramp.metadata.revision, &ramp.metadata.scene), (7, &named(8)));
    assert_eq!(marks(&ramp), [(0, Some(500)), (0, Some(1)), (2, None)]);
    let later = part("later.mcap", Span::Ticks(600..u64::MAX));
    assert_eq!((later.metadata.revision, &later.metadata.scene), (9, &named(9)));
    assert_eq!(ticks(&later), (600, 1000));
    let all = part("all.mcap", Span::Time(0.0..f64::INFINITY));
    assert_eq!(all, read(&whole).expect("reads"));
    let error = cut(&whole, &folder.path("none.csv"), &Span::Time(5.0..6.0), false, None).expect_err("too late");
    assert!(error.to_string().contains("none of its 1000 rows, 0.999 s"), "{error}");
    assert!(!folder.path("none.csv").exists());
}

#[test]
fn one_axis_is_exported_repaired_and_cut() {
    let folder = Folder::new();
    for name in ["r.csv", "r.mcap"] {
        let torn = folder.path(name);
        let mut writer = Writer::create(&torn, &metadata(), false).expect("begun");
        for tick in 1..=1000 {
            writer.entry(&Entry::Row(sample(tick), None)).expect("written");
        }
        writer.break_off().expect("written");
        let length = std::fs::metadata(&torn).expect("it is there").len() - 60;
        let file = std::fs::File::options().write(true).open(&torn).expect("opens");
        file.set_len(length).expect("torn");
        let rows = repair(&torn, &torn, true).expect("repaired").totals.rows;
        assert!((500..=1000).contains(&rows), "{name}: {rows}");
        let [whole, part] = ["whole.parquet", "part.csv"].map(|name| folder.path(name));
        export(&torn, &whole, true).expect("exported");
        cut(&whole, &part, &Span::Ticks(4..6), true, None).expect("cut");
        let part = crate::read(&part).expect("one axis");
        assert_eq!(part.rows, [sample(4), sample(5)], "{name}");
    }
}
