//! `haptic-ctl lease`: a command as a dead man's switch.

use haptic_ipc::{ChangeReply, Changes, Request, RigState};
use rustix::process::Signal;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};
use system_tests::{Daemon, ctl_command, pause, process, status, until_some, wait_for_state};

/// A lease that is not lost where a busy machine lets haptic-ctl wait.
const TIMEOUT: &str = "2s";

fn lease(daemon: &Daemon, timeout: &str, command: &[&str]) -> Child {
    let lease = [&["lease", "--timeout", timeout, "--"], command].concat();
    let mut program = ctl_command(daemon.socket(), &lease);
    program.stdin(Stdio::piped()).spawn().expect("haptic-ctl starts")
}

/// Holds a lease while `cat` waits for its input to end.
fn held(daemon: &Daemon, timeout: &str) -> Child {
    let mut client = daemon.client();
    let child = lease(daemon, timeout, &["cat"]);
    system_tests::wait_for(&mut client, "the lease", |status| status.leases > 0);
    child
}

fn code(mut child: Child) -> Option<i32> {
    drop(child.stdin.take());
    child.wait().expect("it ends").code()
}

#[test]
fn rig_stays_engaged_while_command_runs_and_after_success() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let holder = held(&daemon, TIMEOUT);
    daemon.ctl_ok(&["engage", "--wait"]);
    // Twice as long as the lease lasts without being renewed.
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(4) {
        assert_eq!(status(&mut client).state, RigState::Engaged);
        pause();
    }
    assert_eq!(code(holder), Some(0));
    assert_eq!(status(&mut client).state, RigState::Engaged);
}

#[test]
fn the_rig_is_released_when_haptic_ctl_is_killed_or_hangs() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    for (signal, expected) in [(Signal::KILL, None), (Signal::STOP, Some(6))] {
        let holder = held(&daemon, TIMEOUT);
        daemon.ctl_ok(&["engage", "--wait"]);
        process::signal(holder.id(), signal);
        wait_for_state(&mut client, RigState::Idle);
        // Whatever else is entered after it.
        for k in 1..=120 {
            let change = Request::set([("mass", 1.0 + 0.01 * f64::from(k))].into_iter().collect::<Changes>());
            let _: ChangeReply = client.request(change).expect("a valid change");
        }
        // One that was held up goes on, its command ends well, and it says that the rig was released meanwhile.
        process::signal(holder.id(), Signal::CONT);
        assert_eq!(code(holder), expected, "{signal:?}");
    }
}

#[test]
fn lease_passes_on_exit_code_and_failure_releases_rig() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    for (script, expected) in [("exit 7", 7), ("kill -TERM $$", 143)] {
        daemon.ctl_ok(&["engage", "--wait"]);
        let ended = code(lease(&daemon, "5s", &["sh", "-c", script]));
        assert_eq!(ended, Some(expected), "{script}");
        wait_for_state(&mut client, RigState::Idle);
    }
    // The daemon refuses so short a lease, and haptic-ctl one that no daemon could be asked for.
    for (timeout, command, expected) in [
        ("5s", "true", 0),
        ("5s", "/nonexistent/command", 2),
        ("1ms", "true", 1),
        ("2000h", "true", 2),
    ] {
        let ended = code(lease(&daemon, timeout, &[command]));
        assert_eq!(ended, Some(expected), "{timeout} {command}");
    }
    // A request to end goes on to the command. The interrupt is not that of a terminal, which it would have got too.
    for (signal, expected) in [(Signal::TERM, 143), (Signal::INT, 130)] {
        let mut holder = held(&daemon, "5s");
        // Waiting would close the input, and `cat` would end by that: only the signal may end it.
        let _input = holder.stdin.take().expect("it is a pipe");
        process::signal(holder.id(), signal);
        assert_eq!(code(holder), Some(expected));
    }
    // And a command that ends well has failed where the daemon has gone.
    let holder = held(&daemon, TIMEOUT);
    drop((daemon, client));
    assert_eq!(code(holder), Some(3));
}

#[test]
fn a_haptic_ctl_that_is_killed_takes_the_command_with_it() {
    let daemon = Daemon::start(&[]);
    // Among others in the moment in which the command takes the place of haptic-ctl's copy.
    for attempt in 0..test_run::extent(50, 500) {
        let mut holder = lease(&daemon, TIMEOUT, &["sleep", "1000"]);
        let children = format!("/proc/{0}/task/{0}/children", holder.id());
        let command = until_some("it starts no command", || {
            std::fs::read_to_string(&children).ok()?.trim().parse::<u32>().ok()
        });
        let seen = Instant::now();
        while seen.elapsed() < Duration::from_micros(100 * (attempt % 20)) {
            std::hint::spin_loop();
        }
        holder.kill().expect("it runs");
        until_some("the command goes on", || {
            let stat = std::fs::read_to_string(format!("/proc/{command}/stat")).unwrap_or_default();
            (stat.is_empty() || stat.contains(") Z ")).then_some(())
        });
        drop(holder.wait());
    }
}
