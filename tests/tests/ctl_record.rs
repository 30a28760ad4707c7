//! `haptic-ctl record`.

use haptic_ipc::RigState;
use haptic_recording::{Ending, Mark, Recording};
use rustix::process::Signal;
use std::io::Write;
use std::path::PathBuf;
use std::process::Stdio;
use system_tests::process::end;
use system_tests::recorded::{read, wait_for_more_rows, wait_for_rows};
use system_tests::terminal::Terminal;
use system_tests::{Daemon, ctl_command, ctl_offline_refused, plain, status, stderr, until};

fn somewhere(ending: &str) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join(format!("rig.{ending}"));
    (directory, file)
}

/// The texts of the markers.
fn markers(found: &Recording) -> Vec<&str> {
    found
        .marks
        .iter()
        .filter_map(|(_, mark)| match mark {
            Mark::Marker { text, .. } => Some(text.as_str()),
            _ => None,
        })
        .collect()
}

#[test]
fn a_recording_has_every_tick_of_its_time_and_says_of_what() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere("csv");
    let path = plain(&file);
    let output = daemon.ctl(&["record", path, "--for", "300ms"]);
    assert_eq!(
        (output.status.code(), &*stderr(&output)),
        (Some(0), ""),
        "nothing moves where nobody looks"
    );
    let found = read(&file);
    assert_eq!(found.ending, Ending::Complete);
    assert!(found.metadata.server.starts_with("hapticd"));
    assert!(found.metadata.device.contains("fake rig"));
    assert_eq!((found.metadata.rate_hz, found.metadata.revision), (1000.0, 1));
    assert_eq!(found.metadata.scene.name, "simulated friction");

    daemon.ctl_refused(&["record", path], 2, "--force");
    assert_eq!(read(&file), found, "what was there is untouched");
    let fewer = daemon.ctl_json(&["record", path, "--for", "300ms", "--rate", "100", "--force"]);
    let thinned = read(&file);
    assert_eq!(fewer["rows"], thinned.rows.len(), "{fewer}");
    for (rows, apart) in [(&found.rows, 1), (&thinned.rows, 10)] {
        assert!(rows[rows.len() - 1].t_s - rows[0].t_s < 0.3);
        assert!(rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + apart));
    }
}

#[test]
fn it_ends_when_what_was_asked_for_is_so_or_at_an_interrupt() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    for (until, code) in [(["--until", "state=engaged"], 0), (["--for", "1h"], 130)] {
        let (_directory, file) = somewhere("csv");
        let recorder = daemon.recorder(&file, &until);
        wait_for_rows(&file, 1);
        let output = if code == 0 {
            daemon.ctl_ok(&["engage"]);
            recorder.wait_with_output().expect("it ends")
        } else {
            end(recorder, Signal::INT)
        };
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        let found = read(&file);
        assert_eq!(found.ending, Ending::Complete);
        assert!(found.rows.iter().any(|row| row.state == RigState::Engaged));
    }
}

#[test]
fn a_daemon_that_dies_ends_it_with_3_and_leaves_what_there_was() {
    let daemon = Daemon::start(&[]);
    let (_directory, file) = somewhere("mcap");
    let recorder = daemon.recorder(&file, &["--json"]);
    wait_for_rows(&file, 200);
    drop(daemon);
    let output = recorder.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let found = read(&file);
    assert_eq!(found.ending, Ending::Open);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        (&report["rows"], &report["complete"]),
        (&found.rows.len().into(), &false.into())
    );
    let last = found.marks.last().map(|(_, mark)| mark);
    assert!(
        matches!(last, Some(Mark::Link { text, .. }) if text.contains("lost the daemon")),
        "{last:?}"
    );
}

#[test]
fn its_circumstances_and_notes_are_kept() {
    let daemon = Daemon::start(&["--slew-limit-n-per-s", "4321"]);
    let (directory, file) = somewhere("mcap");
    let path = plain(&file);
    let notes = directory.path().join("notes.txt");
    std::fs::write(&notes, "steel on teflon\n2 N, \"dry\"\n").expect("written");
    daemon.ctl_ok(&["record", path, "--for", "50ms", "--notes-file", plain(&notes)]);
    let metadata = read(&file).metadata;
    assert_eq!(metadata.notes.as_deref(), Some("steel on teflon\n2 N, \"dry\"\n"));
    let configuration = metadata.configuration.as_ref().expect("the status");
    assert_eq!(configuration["device"]["slew_limit_N_per_s"], 4321.0);
    assert!(configuration["real_time"].is_object(), "{configuration}");
    daemon.ctl_ok(&["record", path, "--force", "--for", "50ms", "--notes", "two words"]);
    assert_eq!(read(&file).metadata.notes.as_deref(), Some("two words"));
    let missing = ["record", "other.csv", "--notes-file", "/nonexistent/notes"];
    daemon.ctl_refused(&missing, 2, "/nonexistent/notes");
    let other = directory.path().join("rig.json");
    ctl_offline_refused(
        &["record", plain(&other)],
        2,
        &["rig.json", ".mcap", ".csv", ".parquet"],
    );
    assert!(!other.exists());
}

#[test]
fn markers_are_set_by_keys_and_no_key_passes_for_a_stop() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    daemon.ctl_ok(&["engage", "--wait"]);
    let (_directory, file) = somewhere("csv");
    let mut terminal = Terminal::start(ctl_command(daemon.socket(), &["record", plain(&file)]));
    terminal.wait_for("the keys", |screen| screen.contains("m or 1 to 9: marker, q: end"));
    for (key, answer) in [
        ("m", "marker `marker 1`"),
        ("7", "marker `7`"),
        ("m", "marker `marker 3`"),
        (" ", " stop` does; m or 1 to 9: marker"),
    ] {
        terminal.type_in(key);
        terminal.wait_for(answer, |screen| screen.contains(answer));
    }
    assert!(!terminal.is_as_a_shell_wants_it(), "keys are read one by one");
    terminal.type_in("q");
    assert!(terminal.end().success());
    assert!(terminal.is_as_a_shell_wants_it());
    // Its last line may be broken anywhere between two words.
    let left = terminal.screen().contents();
    let words: Vec<&str> = left.split_whitespace().collect();
    assert!(words.windows(2).any(|pair| pair == ["3", "markers"]), "{left}");
    let found = read(&file);
    assert_eq!(found.ending, Ending::Complete);
    assert_eq!(markers(&found), ["marker 1", "7", "marker 3"]);
    for (row, mark) in &found.marks {
        if let Mark::Marker { tick, .. } = mark {
            let before = found.rows[..*row].last().is_none_or(|row| row.tick < *tick);
            let after = found.rows.get(*row).is_none_or(|row| row.tick >= *tick);
            assert!(before && after, "{mark:?} before row {row}");
        }
    }
    assert_eq!(status(&mut daemon.client()).state, RigState::Engaged);
}

#[test]
fn a_program_sets_markers_by_lines_where_that_is_asked_for() {
    let daemon = Daemon::start(&[]);
    for (more, wanted) in [
        (&["--markers-from-stdin"][..], &["first phase", "second"][..]),
        (&[], &[]),
    ] {
        let (_directory, file) = somewhere("csv");
        let mut command = ctl_command(daemon.socket(), &[&["record", plain(&file)], more].concat());
        let mut recorder = command.stdin(Stdio::piped()).spawn().expect("haptic-ctl starts");
        let mut lines = recorder.stdin.take().expect("it is piped");
        wait_for_rows(&file, 1);
        lines.write_all(b"first phase\n\n  second  \n").expect("written");
        until("the markers do not come", || {
            let found = read(&file);
            markers(&found) == wanted && found.rows.len() >= 300
        });
        drop(lines);
        let ended = if more.is_empty() {
            wait_for_more_rows(&file, 300);
            end(recorder, Signal::TERM)
        } else {
            // The program that set the markers has ended.
            recorder.wait_with_output().expect("it ends")
        };
        assert_eq!(ended.status.code(), Some(0));
        assert_eq!(read(&file).ending, Ending::Complete);
        assert_eq!(markers(&read(&file)), wanted);
    }
    // The end of its input does not cut the time that is asked for.
    let (_directory, file) = somewhere("csv");
    let asked = ["--markers-from-stdin", "--for", "400ms"];
    assert!(daemon.recorder(&file, &asked).wait().expect("it ends").success());
    assert!(read(&file).rows.len() > 300);
}
