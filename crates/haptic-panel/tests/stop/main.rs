//! Stops from the key to the daemon: the whole panel without a window, at a real daemon with its rig
//! engaged, while disks stall and an hour's recording is open.
//!
//! `cargo test --release -p haptic-panel --test stop -- --ignored --nocapture` prints the table of
//! docs/measured.md.

mod desk;
#[path = "../fixture/metadata.rs"]
mod metadata;
#[path = "../fixture/row.rs"]
mod row;

use desk::{Desk, Pipe, an_hour, percentiles};
use haptic_core::Scene;
use haptic_lab::identify::record_file::Source;
use haptic_lab::identify::{ModelKind, Options};
use haptic_panel::{Format, Intent, Page, Question};
use metadata::metadata;
use std::time::{Duration, Instant};

/// Stops of each row of the table.
const STOPS: usize = 1000;

/// Presses Space `count` times while the window draws, and waits for the end of each stop. Returns the sorted times,
/// which the table shows: how long they take is the machine's, that they end while a disk stalls is what is tested.
fn stops(desk: &mut Desk, what: &str, count: usize) -> Vec<Duration> {
    let mut times: Vec<Duration> = (0..count).map(|_| desk.press_and_wait()).collect();
    times.sort();
    println!("{what}: p50, p99, longest {}", percentiles(&times).join(", "));
    times
}

fn record(desk: &mut Desk, pipe: &Pipe) {
    desk.ask(Intent::Record {
        folder: pipe.path().to_path_buf(),
        format: haptic_recording::Format::Csv,
        metadata: Box::new(metadata()),
    });
}

fn record_to_a_stalled_disk(desk: &mut Desk, pipe: &Pipe) {
    record(desk, pipe);
    desk.draw_until("the pipe is full", |_| pipe.is_full());
}

fn export(desk: &mut Desk, pipe: &Pipe) {
    desk.ask(Intent::Export {
        format: Format::Csv,
        folder: pipe.path().to_path_buf(),
    });
}

#[test]
fn stop_from_another_window_is_shown_as_confirmed() {
    let mut desk = Desk::new();
    desk.press_elsewhere();
    desk.draw_until("the confirmation", |desk| desk.shows("(confirmed,"));
    // Longer than a stop may be without news.
    let began = Instant::now();
    desk.draw_until("nothing else", |desk| {
        assert!(!desk.shows("NOT sent"), "it was sent, and confirmed");
        began.elapsed() > Duration::from_millis(500)
    });
}

// hazard: H4
#[test]
fn a_recording_on_a_stalled_disk_does_not_keep_a_stop_waiting() {
    let mut desk = Desk::new();
    let pipe = Pipe::new();
    record_to_a_stalled_disk(&mut desk, &pipe);
    stops(&mut desk, "recording to a stalled disk", 5);
    assert!(pipe.is_full(), "it still stalls");
    desk.ask(Intent::EndRecording);
    stops(&mut desk, "ending that recording", 2);
}

// hazard: H4
#[test]
fn recording_into_an_unopened_pipe_does_not_delay_a_stop() {
    let mut desk = Desk::new();
    let pipe = Pipe::unopened();
    record(&mut desk, &pipe);
    stops(&mut desk, "recording into a pipe that nobody opens", 5);
}

// hazard: H5
#[test]
fn hour_long_recording_does_not_delay_a_stop() {
    let mut desk = Desk::new();
    desk.open(an_hour());
    desk.draw_until("it is drawn", |_| true);
    stops(&mut desk, "an hour's recording open", 5);
    println!("a frame of it: {}", desk.frames());

    // It is not read, so that the export is not over meanwhile.
    let pipe = Pipe::new();
    export(&mut desk, &pipe);
    desk.draw_until("the pipe is full", |_| pipe.is_full());
    stops(&mut desk, "exporting it to a stalled disk", 3);
    assert_eq!(desk.files_busy(), 1, "it is still at work");
    let drained = pipe.drain();
    stops(&mut desk, "exporting it", 3);

    let recording = Pipe::unopened();
    let fed = recording.feed();
    desk.ask(Intent::Open {
        path: recording.path().to_path_buf(),
    });
    stops(&mut desk, "reading another", 3);
    assert!(desk.files_busy() > 0, "it is still at work");
    drop((fed, drained));

    let recording = Pipe::unopened();
    let fed = recording.feed();
    desk.ask(Intent::WhatIf {
        number: 1,
        path: recording.path().to_path_buf(),
        scene: Some(Box::new(Scene::paper().into())),
    });
    stops(&mut desk, "rendering another scene along one", 3);
    assert!(desk.files_busy() > 0, "it is still at work");
    desk.ask(Intent::CancelWhatIf);
    stops(&mut desk, "giving that up", 2);
    drop(fed);
}

#[test]
fn an_identification_does_not_keep_a_stop_waiting() {
    let mut desk = Desk::new();
    desk.turn_to(Page::Identify);
    let record = Pipe::unopened();
    // A pipe that nobody opens keeps its reader waiting.
    let source = Source::new(record.path());
    let options = Options::new(ModelKind::Auto);
    desk.ask(Intent::Identify {
        number: 1,
        question: Box::new(Question::of_file(source, options)),
    });
    stops(&mut desk, "reading a record to identify", 3);
    assert!(desk.files_busy() > 0, "it is still at work");
    drop(record.feed());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("record.csv");
    let rows: String = (0..60_000)
        .map(|tick| (f64::from(tick) * 1e-3, f64::from(tick) * 9e-3))
        .map(|(t_s, angle)| format!("{t_s},{},{}\n", 0.02 * angle.sin(), 3.0 * angle.cos().signum()))
        .collect();
    std::fs::write(&path, format!("t_s,position_m,force_N\n{rows}")).expect("written");
    desk.ask(Intent::Identify {
        number: 2,
        question: Box::new(Question::of_file(Source::new(&path), Options::new(ModelKind::Lugre))),
    });
    stops(&mut desk, "fitting a record", 3);
    desk.ask(Intent::CancelIdentify);
    stops(&mut desk, "giving that up", 2);
}

#[test]
#[ignore = "prints a table; takes minutes"]
fn table_of_stops() {
    let row = |desk: &mut Desk, what| (what, stops(desk, what, STOPS));
    let mut desk = Desk::new();
    let mut times: Vec<Duration> = (0..STOPS).map(|_| desk.stop_without_panel()).collect();
    times.sort();
    let mut rows = vec![("a client without a panel", times), row(&mut desk, "idle panel")];
    let pipe = Pipe::new();
    record_to_a_stalled_disk(&mut desk, &pipe);
    rows.push(row(&mut desk, "recording to a stalled disk"));
    drop(desk);

    let mut desk = Desk::new();
    desk.open(an_hour());
    rows.push(row(&mut desk, "an hour's recording open"));
    println!("a frame of it: {}", desk.frames());
    let mut times = Vec::new();
    while times.len() < STOPS {
        let pipe = Pipe::new();
        let drained = pipe.drain();
        export(&mut desk, &pipe);
        while desk.files_busy() > 0 && times.len() < STOPS {
            times.push(desk.press_and_wait());
        }
        drop(drained);
    }
    times.sort();
    rows.push(("exporting it as CSV", times));
    println!("\n| key to the daemon's confirmation, {STOPS} stops | p50 | p99 | longest |\n|---|---|---|---|");
    for (what, times) in rows {
        println!("| {what} | {} |", percentiles(&times).join(" | "));
    }
}
