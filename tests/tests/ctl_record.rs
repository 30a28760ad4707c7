//! `haptic-ctl record`.

use haptic_ipc::{RigState, Sample};
use haptic_lab::recording::{self, Ending, Mark, Recording};
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Instant;
use system_tests::terminal::Terminal;
use system_tests::{Daemon, PATIENCE, binary};

fn start(daemon: &Daemon, file: &Path, more: &[&str]) -> Child {
    Command::new(binary("haptic-ctl"))
        .arg("record")
        .arg(file)
        .args(more)
        .arg("--socket")
        .arg(daemon.socket())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("haptic-ctl starts")
}

fn read(file: &Path) -> Recording {
    recording::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// Waits until so many rows are on the disk.
fn wait_for_rows(file: &Path, rows: usize) {
    let began = Instant::now();
    while !recording::read(file).is_ok_and(|found| found.rows.len() >= rows) {
        assert!(began.elapsed() < PATIENCE, "waited in vain for {rows} rows");
        system_tests::pause();
    }
}

fn end(child: Child, signal: Signal) -> Output {
    kill_process(Pid::from_child(&child), signal).expect("it runs");
    child.wait_with_output().expect("it ends")
}

fn somewhere() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("rig.csv");
    (directory, file)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_recording_has_every_tick_of_its_time_and_says_of_what() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere();
    let path = file.to_str().expect("text");
    let length_s = |found: &Recording| found.rows[found.rows.len() - 1].t_s - found.rows[0].t_s;
    // Where the machine is busy, the tick that would end it may come late.
    let mut attempts = 0;
    let found = loop {
        let said = daemon.ctl(&["record", path, "--for", "300ms"]);
        assert_eq!(said.status.code(), Some(0), "{}", text(&said.stderr));
        assert!(
            text(&said.stderr).is_empty(),
            "nothing moves where nobody looks: {}",
            text(&said.stderr)
        );
        let found = read(&file);
        assert_eq!(found.ending, Ending::Complete);
        assert!(length_s(&found) < 0.3, "{} s", length_s(&found));
        attempts += 1;
        if length_s(&found) > 0.2975 {
            break found;
        }
        assert!(attempts < 5, "{} s", length_s(&found));
        std::fs::remove_file(&file).expect("it was written");
    };
    let lost: u64 = found
        .marks
        .iter()
        .map(|(_, mark)| if let Mark::Lost { rows } = mark { *rows } else { 0 })
        .sum();
    let late = found
        .rows
        .windows(2)
        .filter(|pair| pair[1].tick != pair[0].tick + 1)
        .count();
    assert!(lost > 0 || late == 0, "{late} ticks are missing and nothing says so");
    assert!(found.metadata.server.starts_with("hapticd"));
    assert!(found.metadata.device.contains("fake rig"));
    assert_eq!((found.metadata.rate_hz, found.metadata.revision), (1000.0, 1));
    assert_eq!(found.metadata.scene.name, "simulated friction");

    let refused = daemon.ctl(&["record", path]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force"), "{}", text(&refused.stderr));
    assert_eq!(read(&file), found, "what was there is untouched");
    let mut attempts = 0;
    loop {
        let fewer = daemon.ctl_ok(&["record", path, "--for", "300ms", "--rate", "100", "--force", "--json"]);
        let fewer: serde_json::Value = serde_json::from_str(&fewer).expect("JSON");
        let found = read(&file);
        let rows = fewer["rows"].as_u64().expect("a number");
        assert_eq!(rows, found.rows.len() as u64, "{fewer}");
        assert!(rows <= 31 && length_s(&found) < 0.3, "{fewer}");
        if fewer["lost"] == 0 {
            let apart = |pair: &[Sample]| pair[1].tick == pair[0].tick + 10;
            assert!(found.rows.windows(2).all(apart), "{fewer}");
            // Periods that are skipped are no ticks.
            if rows >= 28 {
                break;
            }
        }
        attempts += 1;
        assert!(attempts < 5, "{fewer}");
    }
}

#[test]
fn an_interrupt_ends_it_as_it_should_be_and_changes_stand_before_their_rows() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let (_directory, file) = somewhere();
    let recorder = start(&daemon, &file, &[]);
    wait_for_rows(&file, 1);
    daemon.ctl_ok(&["set", "mass=1.5"]);
    daemon.ctl_ok(&["engage", "--wait"]);
    daemon.ctl_ok(&["stop"]);
    wait_for_rows(&file, read(&file).rows.len() + 100);
    let output = end(recorder, Signal::INT);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let found = read(&file);
    assert_eq!(found.ending, Ending::Complete);
    let mut states = Vec::new();
    for (row, mark) in &found.marks {
        match mark {
            Mark::Scene {
                tick, revision, params, ..
            } => {
                assert_eq!((*revision, params["mass"].positive), (2, 1.5));
                assert!(found.rows[*row].tick >= *tick && found.rows[*row - 1].tick < *tick);
                assert_eq!((found.rows[*row].revision, found.rows[*row - 1].revision), (2, 1));
            }
            Mark::State { state, .. } => {
                states.push(*state);
                assert_eq!(found.rows[*row].state, *state);
            }
            _ => {}
        }
    }
    use RigState::{Engaged, Engaging, Idle, Stopped};
    assert_eq!(states, [Idle, Engaging, Engaged, Stopped]);
}

#[test]
fn an_interrupt_before_the_time_that_was_asked_for_is_no_success() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere();
    let recorder = start(&daemon, &file, &["--for", "1h"]);
    wait_for_rows(&file, 1);
    assert_eq!(end(recorder, Signal::INT).status.code(), Some(130));
    assert_eq!(read(&file).ending, Ending::Complete);
}

#[test]
fn whoever_kills_it_loses_its_last_second_at_most() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere();
    let recorder = start(&daemon, &file, &[]);
    wait_for_rows(&file, 200);
    end(recorder, Signal::KILL);
    let found = read(&file);
    assert!(found.rows.len() >= 200);
    assert_ne!(found.ending, Ending::Complete, "nobody ended it on purpose");
}

#[test]
fn a_daemon_that_dies_ends_it_with_3_and_leaves_what_there_was() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere();
    let recorder = start(&daemon, &file, &[]);
    wait_for_rows(&file, 200);
    drop(daemon);
    let output = recorder.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    let found = read(&file);
    assert!(found.rows.len() >= 200);
    assert_eq!(found.ending, Ending::Open);
}

#[test]
fn it_ends_when_what_was_asked_for_is_so() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let (_directory, file) = somewhere();
    let recorder = start(&daemon, &file, &["--until", "state=engaged"]);
    wait_for_rows(&file, 1);
    daemon.ctl_ok(&["engage"]);
    let output = recorder.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let found = read(&file);
    assert!(found.rows.iter().any(|row| row.state == RigState::Engaged));
}

#[test]
fn its_length_size_and_losses_move_on_a_terminal() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere();
    let mut command = Command::new(binary("haptic-ctl"));
    command
        .args(["record", "--for", "1s", "--socket"])
        .arg(daemon.socket())
        .arg(&file);
    let mut terminal = Terminal::start(command);
    terminal.wait_for("the bar", |screen| {
        screen.contains("%") && screen.contains(" rows, ") && screen.contains(" lost")
    });
    assert!(terminal.end().success());
    let left = terminal.screen().contents();
    assert!(
        !left.contains('%') && left.contains(" rows, "),
        "the bar goes, the result stays: {left}"
    );
}

#[test]
fn a_disk_that_is_full_is_said_and_no_success() {
    let daemon = Daemon::start(&[]);
    if !Path::new("/dev/full").exists() {
        eprintln!("skipped: this system has no /dev/full");
        return;
    }
    let output = daemon.ctl(&["record", "/dev/full", "--force", "--for", "100ms"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("/dev/full: No space left"),
        "{}",
        text(&output.stderr)
    );
}
