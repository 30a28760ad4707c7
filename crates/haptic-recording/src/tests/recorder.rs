//! What becomes of events.

use super::plane::y;
use super::*;
use haptic_ipc::{Event, JournalEntry};

fn log(tick: Option<u64>) -> Event {
    Event::Log(Box::new(JournalEntry {
        tick,
        ..JournalEntry::of("engage")
    }))
}

#[test]
fn change_precedes_its_first_row_when_it_comes_late_or_early() {
    for axes in [1, 2] {
        check(axes);
    }
}

/// Records the same events on a rig of one axis or two.
fn check(axes: u8) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.csv");
    let mut recorder = create(&path, &Metadata { axes, ..metadata() }, false).expect("begun");
    let samples = |ticks, dropped| {
        let mut event = samples(ticks, dropped);
        if let Event::Samples(samples) = &mut event
            && axes == 2
        {
            samples.rows_y = samples.rows.iter().map(|row| y(row.tick)).collect();
        }
        event
    };
    for event in [
        state(0, RigState::Idle, 7),
        samples(1..11, 0),
        log(Some(15)),
        // What no tick carried out is not of the recording.
        log(None),
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
    let marker = |tick| Mark::Marker {
        tick,
        text: "here".into(),
    };
    recorder.mark(marker(30));
    recorder.mark(marker(60));
    // More is missing than the daemon reports, and the loop missed periods.
    recorder.event(&samples(41..43, 6)).expect("written");
    let mut late = samples(43..44, 0);
    if let Event::Samples(samples) = &mut late {
        samples.rows[0].t_s = 0.048;
    }
    recorder.event(&late).expect("written");
    let totals = recorder.finish().expect("written");
    assert_eq!((totals.rows, totals.lost, totals.missed), (33, 3 + 6 + 4, 5));
    assert!((totals.length_s - 0.047).abs() < 1e-12);
    assert_eq!(totals.bytes, std::fs::metadata(&path).expect("it is there").len());
    let recording = open_any(&path).and_then(Reader::into_recording).expect("reads");
    assert_eq!(recording.ending, Ending::Complete);
    let ticks = (1..31).chain(41..44);
    assert!(recording.rows.iter().map(|row| row.tick).eq(ticks.clone()));
    let ys: Vec<SampleY> = ticks.filter(|_| axes == 2).map(y).collect();
    assert_eq!(recording.rows_y, ys);
    let kind = |mark: &Mark| match mark {
        Mark::Scene { .. } => "scene".to_owned(),
        Mark::State { state, .. } => state.to_string(),
        Mark::Journal { .. } => "journal".to_owned(),
        Mark::Marker { .. } => "marker".to_owned(),
        other => serde_json::to_string(other).expect("JSON"),
    };
    let marks = recording.marks.iter();
    let places: Vec<(usize, String)> = marks.map(|(row, mark)| (*row, kind(mark))).collect();
    let lost = [3, 6, 4].map(|rows| format!(r#"{{"mark":"lost","rows":{rows}}}"#));
    let missed = r#"{"mark":"missed","tick":43,"periods":5}"#;
    let end = r#"{"mark":"end","rows":33,"lost":13,"missed":5}"#;
    let expected = [
        (0, "idle"),
        (10, &*lost[0]),
        (14, "journal"),
        (14, "scene"),
        (14, "engaging"),
        (20, "engaged"),
        (30, &*lost[1]),
        (30, "marker"),
        (30, "stopped"),
        // More than was announced.
        (30, &*lost[2]),
        (32, missed),
        (33, "marker"),
        (33, end),
    ];
    assert_eq!(places, expected.map(|(row, kind)| (row, kind.to_owned())));
}
