use super::super::Format;
use super::super::tests::{metadata, read_bytes, samples, state};
use super::*;
use haptic_ipc::RigState;
use std::fs::{File, OpenOptions};
use std::path::PathBuf;
use std::process::Command;
use std::sync::mpsc;

const SMALL: Room = Room { rows: 20, changes: 3 };

fn marker(tick: u64) -> Mark {
    Mark::Marker {
        tick,
        text: tick.to_string(),
    }
}

/// A disk that hangs: a pipe that nobody has opened yet.
fn hanging() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().expect("a directory");
    let pipe = directory.path().join("pipe.csv");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo runs").success());
    (directory, pipe)
}

/// A thread that writes into a file which it opens itself, and what it returns.
fn recording_into(path: PathBuf) -> (RecordingThread, mpsc::Receiver<io::Result<Totals>>) {
    let (end, ended) = mpsc::channel();
    let write = move |waiting: &WaitingParts| {
        let recorder = OpenOptions::new()
            .write(true)
            .open(&path)
            .and_then(|file: File| Recorder::new(Format::Csv, file, &path, &metadata()));
        let written = recorder.and_then(|recorder| waiting.write(recorder, |_| {}));
        end.send(written).expect("the test waits");
    };
    (RecordingThread::with(SMALL, write).expect("a thread"), ended)
}

// hazard: H4
#[test]
fn hanging_disk_losses_are_counted_and_newest_scene_is_kept() {
    let (_directory, pipe) = hanging();
    let (recording, ended) = recording_into(pipe.clone());
    assert_eq!(recording.event(&samples(1..11, 0)), Enqueued::Yes);
    assert_eq!(recording.event(&samples(11..21, 0)), Enqueued::Yes);
    let no = |lost_rows, lost_changes| Enqueued::No {
        lost_rows,
        lost_changes,
    };
    assert_eq!(recording.event(&samples(21..24, 0)), no(3, 0), "twenty rows wait");
    let change = recording.event(&state(24, RigState::Engaged, 8));
    assert_eq!(change, Enqueued::Yes, "there is room for changes");
    assert_eq!(recording.mark(marker(24)), Enqueued::Yes);
    assert_eq!(recording.event(&state(25, RigState::Engaged, 9)), Enqueued::Yes);
    assert_eq!(recording.mark(marker(26)), no(3, 1), "three changes wait");
    assert_eq!(recording.event(&state(27, RigState::Engaged, 10)), no(3, 2));
    assert_eq!(recording.event(&state(28, RigState::Engaged, 11)), no(3, 3));
    assert_eq!(recording.event(&samples(28..31, 0)), no(6, 3));
    recording.flush();
    recording.finish();
    // Now the disk works again.
    let bytes = std::fs::read(&pipe).expect("it is written to its end");
    let totals = ended.recv().expect("it ends").expect("written");
    assert_eq!((totals.rows, totals.lost, totals.lost_changes), (20, 6, 2));
    let found = read_bytes(&bytes).expect("a recording");
    assert!(
        found.marks.iter().all(|(rows, _)| *rows == 20),
        "behind all that found room"
    );
    let marks: Vec<_> = found.marks.iter().map(|(_, mark)| described(mark)).collect();
    let after_losses = ["scene 8", "state", "marker 24", "scene 9", "scene 11", "end"];
    assert_eq!(marks, [&["6 rows lost", "2 changes lost"], &after_losses[..]].concat());
}

fn described(mark: &Mark) -> String {
    match mark {
        Mark::Scene { revision, .. } => format!("scene {revision}"),
        Mark::State { .. } => "state".to_owned(),
        Mark::Marker { text, .. } => format!("marker {text}"),
        Mark::Lost { rows } => format!("{rows} rows lost"),
        Mark::LostChanges { changes } => format!("{changes} changes lost"),
        Mark::End { .. } => "end".to_owned(),
        _ => format!("{mark:?}"),
    }
}

#[test]
fn row_after_a_gap_follows_the_loss_and_the_newest_scene() {
    let (begin, begun) = mpsc::channel();
    let (_directory, pipe) = hanging();
    let path = pipe.clone();
    let write = move |waiting: &WaitingParts| {
        begun.recv().expect("the test lets it begin");
        let file = OpenOptions::new().write(true).open(&path).expect("the test reads");
        let recorder = Recorder::new(Format::Csv, file, &path, &metadata()).expect("begun");
        waiting.write(recorder, |_| {}).expect("written");
    };
    let recording = RecordingThread::with(SMALL, write).expect("a thread");
    for revision in 8..14 {
        recording.event(&state(revision, RigState::Engaged, revision));
    }
    let reader = std::thread::spawn(move || std::fs::read(&pipe).expect("it is written to its end"));
    begin.send(()).expect("it waits");
    // The thread makes room as it takes the changes.
    let mut tick = 14;
    while recording.event(&samples(tick..tick + 1, 0)) != Enqueued::Yes {
        tick += 1;
        std::thread::yield_now();
    }
    recording.finish();
    let bytes = reader.join().expect("it reads");
    let found = read_bytes(&bytes).expect("a recording");
    assert_eq!(found.rows.len(), 1);
    let before = found.marks.iter().filter(|(rows, _)| *rows == 0);
    let before: Vec<_> = before.map(|(_, mark)| described(mark)).collect();
    assert!(before.contains(&"2 changes lost".to_owned()), "{before:?}");
    assert!(before.contains(&"scene 13".to_owned()), "{before:?}");
    let is_told = before.contains(&format!("{} rows lost", tick - 14));
    assert_eq!(is_told, tick > 14, "{before:?}");
}

#[test]
fn a_full_disk_ends_it_and_nothing_is_kept_any_more() {
    if !std::path::Path::new("/dev/full").exists() {
        test_run::skip("/dev/full", "a system that has it");
        return;
    }
    let (recording, ended) = recording_into("/dev/full".into());
    // The heading alone may fail, or the first rows that are passed on.
    recording.event(&samples(1..11, 0));
    recording.flush();
    let error = ended.recv().expect("it ends").expect_err("nothing fits there");
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    while recording.event(&samples(11..12, 0)) != Enqueued::Ended {
        std::thread::yield_now();
    }
    assert_eq!(recording.mark(marker(12)), Enqueued::Ended);
}

#[test]
fn one_that_is_dropped_has_what_waited_and_no_end() {
    let (_directory, pipe) = hanging();
    let (recording, ended) = recording_into(pipe.clone());
    recording.event(&samples(1..11, 0));
    drop(recording);
    let bytes = std::fs::read(&pipe).expect("it is written to its end");
    assert_eq!(ended.recv().expect("it ends").expect("written").rows, 10);
    let found = read_bytes(&bytes).expect("a recording");
    assert_eq!((found.rows.len(), found.ending), (10, super::super::Ending::Open));
}
