//! What becomes of events.

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
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("r.csv");
    let mut recorder = create(&path, &metadata(), false).expect("begun");
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
    let late = Event::Samples(SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: vec![Sample {
            t_s: 0.048,
            ..sample(43)
        }],
        ..SamplesEvent::default()
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
                Mark::Journal { .. } => "journal",
                Mark::Lost { rows: 4 } => "unannounced",
                Mark::Lost { .. } => "lost",
                Mark::Missed { tick: 43, periods: 5 } => "missed",
                Mark::Marker { .. } => "marker",
                Mark::End {
                    rows: 33,
                    lost: 13,
                    missed: 5,
                } => "end",
                Mark::Missed { .. }
                | Mark::Link { .. }
                | Mark::End { .. }
                | Mark::Servo { .. }
                | Mark::Snapshot { .. }
                | Mark::LostChanges { .. } => "wrong",
            };
            (*row, kind)
        })
        .collect();
    assert_eq!(
        places,
        [
            (0, "idle"),
            (10, "lost"),
            (14, "journal"),
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
