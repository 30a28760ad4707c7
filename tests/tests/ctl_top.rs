//! `haptic-ctl top` on a real terminal.

use haptic_ipc::RigState;
use rustix::process::{Signal, kill_process};
use system_tests::terminal::Terminal;
use system_tests::{Daemon, bring_to, ctl_command, journal, process, status, wait_for_state};

fn top(daemon: &Daemon, no_color: &str) -> Terminal {
    let mut command = ctl_command(daemon.socket(), &["top"]);
    // Somebody may have set it for the tests too.
    command.env("NO_COLOR", no_color);
    let mut top = Terminal::start(command);
    top.wait_for("its first picture", |screen| {
        screen.contains("wake-up") && screen.contains("SCHED_") | screen.contains("ordinary priority")
    });
    top
}

#[test]
fn top_fits_a_small_screen_and_keys_drive_rig() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let mut top = top(&daemon, "");
    let parts = [
        "IDLE",
        "1000 Hz",
        "simulated friction, karnopp, revision 1",
        "force on the hand",
        "position of the device",
        "p50",
        "overruns",
        "clients",
        "space/Esc STOP",
    ];
    // It fills up little by little.
    top.wait_for(&format!("all of {parts:?}"), |screen| {
        parts.iter().all(|part| screen.contains(part))
    });
    top.type_in("e");
    top.wait_for("engaged", |screen| screen.contains("ENGAGED"));
    wait_for_state(&mut client, RigState::Engaged);
    top.type_in("?");
    top.wait_for("the help", |screen| screen.contains("clear a stop or a fault"));
    // Even now the largest key stops.
    top.type_in(" ");
    top.wait_for("the stop", |screen| {
        ["STOPPED", "stop confirmed at tick", ": stopped"]
            .iter()
            .all(|part| screen.contains(part))
    });
    wait_for_state(&mut client, RigState::Stopped);
    top.type_in("e");
    top.wait_for("the refusal", |screen| {
        screen.contains("cannot engage while the rig is stopped")
    });
    top.type_in("R");
    top.wait_for("idle", |screen| screen.contains("IDLE"));
    top.type_in("e");
    wait_for_state(&mut client, RigState::Engaged);
    top.type_in("r");
    wait_for_state(&mut client, RigState::Idle);
    top.type_in("q");
    assert!(top.end().success());
    assert!(top.is_as_a_shell_wants_it());
}

#[test]
fn a_terminal_that_takes_no_picture_keeps_no_key_waiting() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let mut top = top(&daemon, "");
    top.stop_output();
    top.type_in("e");
    wait_for_state(&mut client, RigState::Engaged);
    top.type_in(" ");
    wait_for_state(&mut client, RigState::Stopped);
    top.resume_output();
    top.wait_for("the stop", |screen| screen.contains("stop confirmed at tick"));
    top.stop_output();
    top.type_in("q");
    assert!(top.end().success());
}

#[test]
fn a_change_of_the_terminals_size_swallows_no_key() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let mut top = top(&daemon, "");
    // Where keys are waited for by an edge, one of eight is lost.
    for _ in 0..30 {
        for (key, state) in [(" ", RigState::Stopped), ("R", RigState::Idle)] {
            for _ in 0..3 {
                kill_process(top.pid(), Signal::WINCH).expect("it runs");
            }
            top.type_in(key);
            wait_for_state(&mut client, state);
        }
    }
}

#[test]
fn the_terminal_is_put_back_however_it_ends() {
    let daemon = Daemon::start(&[]);
    for (keys, signal, code) in [
        ("q", None, 0),
        ("\x03", None, 0),
        ("", Some(Signal::INT), 130),
        ("", Some(Signal::TERM), 143),
        ("", Some(Signal::HUP), 129),
    ] {
        // Colours are left out where they are not wanted.
        let no_color = if keys == "q" { "1" } else { "" };
        let mut top = top(&daemon, no_color);
        assert!(!top.is_as_a_shell_wants_it(), "it has the terminal for itself");
        top.type_in(keys);
        if let Some(signal) = signal {
            kill_process(top.pid(), signal).expect("it runs");
        }
        assert_eq!(top.end().code(), Some(code), "{keys:?} {signal:?}");
        assert!(top.is_as_a_shell_wants_it(), "{keys:?} {signal:?}");
        let written = top.written();
        // A foreground colour: 30 to 39 or 38;5;N.
        let is_coloured = (30..39)
            .any(|colour| written.contains(&format!("\x1b[{colour}m")) || written.contains(&format!("\x1b[{colour};")));
        assert_eq!(is_coloured, no_color.is_empty());
    }
    daemon.ctl_refused(&["top"], 2, "haptic-ctl log --follow");
    let mut top = top(&daemon, "");
    drop(daemon);
    assert_eq!(top.end().code(), Some(3), "the daemon has gone");
    assert!(top.is_as_a_shell_wants_it());
    assert!(top.screen().contents().contains("closed the connection"));
}

// hazard: H4
#[test]
fn a_stop_that_a_hung_daemon_does_not_confirm_says_so() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let mut top = top(&daemon, "");
    top.type_in(" ");
    top.wait_for("the first stop", |screen| screen.contains("stop confirmed at tick"));
    bring_to(&mut client, RigState::Engaged);
    top.wait_for("engaged", |screen| screen.contains("ENGAGED"));
    process::signal(daemon.pid(), Signal::STOP);
    // Before anybody presses anything.
    top.wait_for("the silence", |screen| {
        screen.contains("no word from the daemon for ")
            && screen.contains(" s: if the motor pulls, cut its power")
            && screen.contains("ENGAGED, last")
    });
    top.type_in(" ");
    let shown = top.wait_for("the alarm", |screen| screen.contains("no answer yet"));
    assert!(
        shown.contains("ENGAGED, last") && !shown.contains("confirmed"),
        "{shown}"
    );
    process::signal(daemon.pid(), Signal::CONT);
    top.wait_for("its answer", |screen| screen.contains("stop confirmed at tick"));
}

// hazard: H4
#[test]
fn an_engage_on_a_hung_daemon_brings_no_force_later() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let mut top = top(&daemon, "");
    process::signal(daemon.pid(), Signal::STOP);
    // Before anybody knows, and withdrawn; and when top knows it.
    top.type_in("e");
    top.wait_for("the silence", |screen| screen.contains("no word from the daemon"));
    top.type_in("e");
    top.wait_for("the refusal", |screen| screen.contains("engage is not sent"));
    top.wait_for("the withdrawal", |screen| screen.contains("engage is withdrawn"));
    process::signal(daemon.pid(), Signal::CONT);
    top.wait_for("its answer", |screen| {
        screen.contains("IDLE") && !screen.contains("IDLE, last")
    });
    assert_eq!(status(&mut client).state, RigState::Idle);
    let entries = journal(&mut client);
    assert!(entries.iter().all(|entry| entry.op != "engage"), "{entries:?}");
}
