use super::*;
use haptic_ipc::{Event, SAMPLE_COLUMNS, Sample, SamplesEvent, StateEvent};
use proptest::prelude::*;
use std::path::Path;

fn scene() -> Scene {
    Scene::paper()
}

pub(super) fn metadata() -> Metadata {
    Metadata {
        server: "hapticd 0.1.0".into(),
        device: "fake rig, \"of glass\"".into(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 1.763_748_187_123e9,
        revision: 7,
        scene: scene(),
        servo: None,
        notes: None,
        configuration: None,
    }
}

pub(super) fn sample(tick: u64) -> Sample {
    Sample {
        tick,
        t_s: 1e-3 * f64::from(u32::try_from(tick).expect("small")),
        state: RigState::Engaged,
        contact: -1,
        device_position_m: 0.1,
        device_velocity_mps: -0.2,
        block_position_m: 1.0 / 3.0,
        block_velocity_mps: 0.0,
        coupling_force_n: 5.5,
        command_force_n: -5.5,
        revision: 7,
        wake_latency_ns: 100,
        tick_ns: 200,
        device_round_trip_ns: 0,
        ..Sample::default()
    }
}

fn state(tick: u64, state: RigState, revision: u64) -> Event {
    Event::State(StateEvent {
        state,
        fault: None,
        tick,
        revision,
        scene: "another".into(),
        law: "karnopp".into(),
        params: haptic_ipc::params_of(&scene()),
        undo_depth: 0,
        redo_depth: 0,
        arrival: None,
    })
}

fn samples(ticks: std::ops::Range<u64>, dropped: u64) -> Event {
    Event::Samples(SamplesEvent {
        seq: 0,
        dropped,
        rows: ticks.map(sample).collect(),
    })
}

/// Writes a recording; returns its bytes and totals.
fn written(format: Format, metadata: &Metadata, entries: &[Entry]) -> (Vec<u8>, Totals) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r").with_extension(format.ending());
    let mut writer = Writer::create(&path, metadata, false).expect("begun");
    for entry in entries {
        writer.entry(entry).expect("written");
    }
    let totals = writer.finish().expect("written");
    (std::fs::read(&path).expect("it is there"), totals)
}

fn recording(rows: &[Sample]) -> Vec<u8> {
    let entries: Vec<Entry> = rows.iter().copied().map(Entry::Row).collect();
    written(Format::Csv, &metadata(), &entries).0
}

fn read_bytes(bytes: &[u8]) -> Result<Recording, RecordingError> {
    Reader::from_bytes(bytes.to_vec())?.into_recording()
}

#[test]
fn a_recording_reads_as_its_description_shows_it() {
    let text = String::from_utf8(recording(&[sample(1)])).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "# hapticd recording 1");
    assert!(
        lines[1].starts_with(r##"# {"server":"hapticd 0.1.0","device":"fake rig, \"of glass\"","loop_rate_hz""##),
        "{}",
        lines[1]
    );
    assert_eq!(lines[2], SAMPLE_COLUMNS.join(","));
    assert_eq!(
        lines[3],
        "1,0.001,engaged,-1,0.1,-0.2,0.3333333333333333,0.0,5.5,-5.5,7,100,200,0,0,0,0,0.0,0,0"
    );
    assert_eq!(lines[4], r##"# {"mark":"end","rows":1,"lost":0,"missed":0}"##);
}

#[test]
fn a_change_stands_before_the_first_row_that_it_concerns_though_it_came_late_or_early() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.csv");
    let mut recorder = create(&path, &metadata(), false).expect("begun");
    for event in [
        state(0, RigState::Idle, 7),
        samples(1..11, 0),
        // Early: its tick is among rows that are still to come.
        state(15, RigState::Engaging, 8),
        samples(11..21, 3),
        // Late: rows of its tick are there already.
        state(18, RigState::Engaged, 8),
        samples(21..31, 0),
        // After the last row.
        state(40, RigState::Stopped, 8),
    ] {
        recorder.event(&event).expect("written");
    }
    assert_eq!(recorder.last_tick(), Some(30));
    let marker = |tick| Mark::Marker {
        tick,
        text: "here".into(),
    };
    recorder.mark(marker(30));
    recorder.mark(marker(60));
    // More is missing than the daemon tells of, and the loop missed periods.
    recorder.event(&samples(41..43, 6)).expect("written");
    let late = Event::Samples(SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: vec![Sample {
            t_s: 0.048,
            ..sample(43)
        }],
    });
    recorder.event(&late).expect("written");
    let totals = recorder.finish().expect("written");
    assert_eq!((totals.rows, totals.lost, totals.missed), (33, 3 + 6 + 4, 5));
    assert!((totals.length_s - 0.047).abs() < 1e-12);
    assert_eq!(totals.bytes, std::fs::metadata(&path).expect("it is there").len());
    let recording = read(&path).expect("reads");
    assert_eq!(recording.ending, Ending::Complete);
    let places: Vec<(usize, &str)> = recording
        .marks
        .iter()
        .map(|(row, mark)| {
            let kind = match mark {
                Mark::Scene { .. } => "scene",
                Mark::State { state, .. } => match state {
                    RigState::Idle => "idle",
                    RigState::Engaging => "engaging",
                    RigState::Engaged => "engaged",
                    _ => "stopped",
                },
                Mark::Lost { rows: 4 } => "unannounced",
                Mark::Lost { .. } => "lost",
                Mark::Missed { tick: 43, periods: 5 } => "missed",
                Mark::Marker { .. } => "marker",
                Mark::End {
                    rows: 33,
                    lost: 13,
                    missed: 5,
                } => "end",
                Mark::Missed { .. } | Mark::Link { .. } | Mark::End { .. } => "wrong",
            };
            (*row, kind)
        })
        .collect();
    assert_eq!(
        places,
        [
            (0, "idle"),
            (10, "lost"),
            (14, "scene"),
            (14, "engaging"),
            (20, "engaged"),
            (30, "lost"),
            (30, "marker"),
            (30, "stopped"),
            (30, "unannounced"),
            (32, "missed"),
            (33, "marker"),
            (33, "end")
        ]
    );
}

#[test]
fn a_recording_that_was_broken_off_reads_up_to_its_last_whole_row() {
    let rows: Vec<Sample> = (1..6).map(sample).collect();
    let whole = recording(&rows);
    let text = String::from_utf8(whole.clone()).expect("text");
    let header_ends = text.match_indices('\n').nth(2).expect("three lines").0 + 1;
    for length in header_ends..whole.len() {
        let cut = read_bytes(&whole[..length]).expect("what is whole reads");
        let whole_lines = text[header_ends..length].matches('\n').count();
        assert_eq!(cut.rows, rows[..whole_lines], "cut at {length}");
        if text[..length].ends_with('\n') {
            assert_eq!(cut.ending, Ending::Open, "cut at {length}");
        } else {
            assert!(matches!(cut.ending, Ending::BrokenOff { .. }), "cut at {length}");
            assert!(cut.ending.to_string().contains("broken off in line"), "{}", cut.ending);
        }
    }
    assert_eq!(read_bytes(&whole).expect("reads").ending, Ending::Complete);
    let error = read_bytes(&whole[..header_ends - 1]).expect_err("there is no row");
    assert!(error.to_string().contains("before its first row"), "{error}");
}

#[test]
fn a_writer_that_dies_has_passed_on_all_but_its_last_second() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("dies.csv");
    let mut writer = Writer::create(&path, &metadata(), false).expect("begun");
    assert_eq!(read(&path).expect("the header is there at once").ending, Ending::Open);
    writer.rows(&[sample(1)]).expect("written");
    std::thread::sleep(std::time::Duration::from_millis(1010));
    writer.rows(&[sample(2)]).expect("written");
    let found = read(&path).expect("reads while it is being written");
    assert_eq!(found.rows.len(), 2);
    // As a process that is killed: what is in memory is lost.
    std::mem::forget(writer);
}

#[test]
fn what_is_no_recording_is_refused_by_its_line() {
    let whole = String::from_utf8(recording(&[sample(1), sample(2)])).expect("text");
    for (damaged, parts) in [
        (String::new(), vec!["line 1"]),
        (
            "t_s,device_position_m\n0,0\n".to_owned(),
            vec!["begins with `t_s,device_position_m`"],
        ),
        ("\u{7f}ELF".to_owned(), vec!["not a recording"]),
        (
            whole.replace("recording 1", "recording 2"),
            vec!["version 2", "reads version 1"],
        ),
        (whole.replace("\"rate_hz\"", "\"rate\""), vec!["metadata", "rate_hz"]),
        (whole.replace("# {\"server", "# {server"), vec!["line 2", "metadata"]),
        (
            whole.replace("block_position_m", "block_m"),
            vec!["line 3", "column 7", "`block_position_m`", "`block_m`"],
        ),
        (whole.replace("2,0.002,", "2,soon,"), vec!["line 5", "soon"]),
        (
            whole.replace("2,0.002,engaged", "2,0.002,asleep"),
            vec!["line 5", "asleep"],
        ),
        (
            whole.replacen(",0.0,0,0\n2,", "\n2,", 1),
            vec!["line 4", "is no row", "17 cells of 20"],
        ),
        (
            whole.replace("\"rows\":2", "\"rows\":two"),
            vec!["line 6", "is no mark"],
        ),
        (format!("{}\n", "9".repeat(2 << 20)), vec!["line 1 is longer"]),
    ] {
        let error = read_bytes(damaged.as_bytes()).expect_err("damaged").to_string();
        for part in parts {
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
    let error = read(std::path::Path::new("/nonexistent.csv"))
        .expect_err("no file")
        .to_string();
    assert!(error.contains("/nonexistent.csv"), "{error}");
}

#[test]
fn remarks_and_what_a_later_version_adds_are_passed_over() {
    let whole = String::from_utf8(recording(&[sample(1)])).expect("text");
    let later = whole.replace("error_detail\n", "error_detail,mood\n").replace(
        ",0.0,0,0\n",
        ",0.0,0,0,good\n\n# a remark\n# {\"mark\":\"weather\",\"wind\":3}\n",
    );
    assert_ne!(later, whole);
    assert_eq!(
        read_bytes(later.as_bytes()).expect("reads"),
        read_bytes(whole.as_bytes()).expect("reads")
    );
    let windows = whole.replace('\n', "\r\n");
    assert_eq!(
        read_bytes(windows.as_bytes()).expect("reads"),
        read_bytes(whole.as_bytes()).expect("reads")
    );
}

#[test]
fn a_recording_of_an_earlier_version_reads_without_the_columns_that_it_lacks() {
    let whole = String::from_utf8(recording(&[sample(1)])).expect("text");
    let added = SAMPLE_COLUMNS[haptic_ipc::FIRST_SAMPLE_COLUMNS..].join(",");
    let earlier = whole
        .replace(&format!(",{added}"), "")
        .replace(",0,0,0,0.0,0,0\n", "\n");
    let lines: Vec<&str> = earlier.lines().collect();
    assert!(lines[2].ends_with(",device_round_trip_ns"), "{}", lines[2]);
    assert_eq!(lines[2].split(',').count(), lines[3].split(',').count(), "{}", lines[3]);
    assert_eq!(read_bytes(earlier.as_bytes()).expect("reads").rows, [sample(1)]);
}

#[test]
fn a_full_disk_is_an_error_and_not_a_short_recording() {
    if !Path::new("/dev/full").exists() {
        test_run::skip("/dev/full", "run on Linux");
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("full.csv");
    std::os::unix::fs::symlink("/dev/full", &path).expect("a link");
    let error = Writer::create(&path, &metadata(), true)
        .map(drop)
        .expect_err("nothing fits");
    let CreateError::File { source, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
}

#[test]
fn what_is_there_is_replaced_only_on_demand_and_the_name_says_the_format() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.CSV");
    std::fs::write(&path, "precious").expect("written");
    let error = create(&path, &metadata(), false).map(drop).expect_err("it is there");
    assert!(
        matches!(&error, CreateError::File { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).expect("it is there"), b"precious");
    create(&path, &metadata(), true)
        .expect("replaced")
        .finish()
        .expect("written");
    assert_eq!(read(&path).expect("reads").ending, Ending::Complete);
    for name in ["r", "r.txt", "r.mcap.gz", ".csv"] {
        let error = create(&directory.path().join(name), &metadata(), true)
            .map(drop)
            .expect_err("no format");
        let error = error.to_string();
        for part in [name, ".mcap", ".csv", ".parquet"] {
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("NaN equals nothing", |number| !number.is_nan())
}

fn any_sample() -> impl Strategy<Value = Sample> {
    let state = prop::sample::select(RigState::ALL.to_vec());
    let numbers = prop::collection::vec(any_number(), 8);
    let counts = prop::array::uniform7(any::<u64>());
    let words = prop::array::uniform3(any::<u32>());
    (state, -1_i8..=1, numbers, counts, words).prop_map(|(state, contact, x, counts, words)| Sample {
        tick: counts[0],
        t_s: x[0],
        state,
        contact,
        device_position_m: x[1],
        device_velocity_mps: x[2],
        block_position_m: x[3],
        block_velocity_mps: x[4],
        coupling_force_n: x[5],
        command_force_n: x[6],
        revision: counts[1],
        wake_latency_ns: counts[2],
        tick_ns: counts[3],
        device_round_trip_ns: counts[4],
        elapsed_ns: counts[5],
        device_sequence: words[0],
        device_time_ns: counts[6],
        sample_position_m: x[7],
        input_flags: words[1],
        error_detail: words[2],
    })
}

fn any_mark() -> impl Strategy<Value = Mark> {
    let finite = || any::<f64>().prop_filter("JSON has finite numbers only", |number| number.is_finite());
    prop_oneof![
        (any::<u64>(), any::<u64>(), ".{0,20}", finite(), finite()).prop_map(|(tick, revision, name, one, other)| {
            let params = [
                ("mass".to_owned(), Directional::both(one)),
                (
                    "static_force".to_owned(),
                    Directional {
                        positive: one,
                        negative: other,
                    },
                ),
            ];
            Mark::Scene {
                tick,
                revision,
                name,
                law: "karnopp".into(),
                params: params.into(),
                arrival: None,
            }
        }),
        (any::<u64>(), prop::option::of(".{0,20}")).prop_map(|(tick, fault)| Mark::State {
            tick,
            state: RigState::Faulted,
            fault
        }),
        any::<u32>().prop_map(|rows| Mark::Lost { rows: rows.into() }),
        (any::<u64>(), any::<u32>()).prop_map(|(tick, periods)| Mark::Missed {
            tick,
            periods: periods.into()
        }),
        (any::<u64>(), ".{0,20}").prop_map(|(tick, text)| Mark::Marker { tick, text }),
        (any::<u64>(), ".{0,20}").prop_map(|(tick, text)| Mark::Link { tick, text }),
    ]
}

proptest! {
    #[test]
    fn what_is_written_is_what_is_read(
        entries in prop::collection::vec(prop_oneof![any_sample().prop_map(Entry::Row), any_mark().prop_map(Entry::Mark)], 0..40),
        started in 0.0..1e11_f64,
        mass in 1e-6..100.0_f64,
    ) {
        let mut about = metadata();
        about.started_unix_s = started;
        about.scene.block.as_mut().expect("the scene has a block").mass = mass;
        let (bytes, _) = written(Format::Csv, &about, &entries);
        let mut reader = Reader::from_bytes(bytes).expect("reads");
        prop_assert_eq!(reader.metadata(), &about);
        let mut read: Vec<Entry> = reader.by_ref().collect::<Result<_, _>>().expect("reads");
        let ends = matches!(read.pop(), Some(Entry::Mark(Mark::End { .. })));
        prop_assert!(ends);
        prop_assert_eq!(read, entries);
        prop_assert_eq!(reader.ending(), Some(Ending::Complete));
    }

    #[test]
    fn no_bytes_panic_the_reader(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        drop(read_bytes(&bytes));
    }

    #[test]
    fn no_damage_panics_the_reader(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        end in any::<prop::sample::Index>(),
    ) {
        let mut bytes = recording(&[sample(1), sample(2), sample(3)]);
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        bytes.truncate(end.index(bytes.len() + 1));
        drop(read_bytes(&bytes));
    }
}
