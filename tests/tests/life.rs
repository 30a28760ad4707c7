//! How a daemon comes and goes: sockets, configuration, privileges, signals.

use haptic_ipc::{Request, RigState, StateReply};
use rustix::process::Signal;
use std::process::{Command, Stdio};
use system_tests::{Daemon, binary, engage, is_refused, plain, process, status, wait_for_state};

/// Runs hapticd with arguments with which it cannot run, which it must say; returns what it said.
fn refused(arguments: &[&str], code: i32, parts: &[&str]) -> String {
    let output = Command::new(binary("hapticd"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("hapticd starts");
    is_refused(&format!("{arguments:?}"), &output, code, parts)
}

#[test]
fn a_socket_in_use_is_refused_and_a_stale_one_is_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("rig/control.sock");
    let path = plain(&socket);
    let first = Daemon::start_at(&socket, &[]);
    let arguments = ["--device", "fake", "--socket", path];
    refused(&arguments, 1, &[path, "in use"]);
    assert_eq!(
        status(&mut first.client()).state,
        RigState::Idle,
        "the first is unharmed"
    );

    // Killed, it cannot clean up.
    drop(first);
    assert!(socket.exists());
    let second = Daemon::start_at(&socket, &[]);
    assert_eq!(status(&mut second.client()).state, RigState::Idle);
    let (ended, _) = second.end(Signal::TERM);
    assert!(ended.success());
    let left: Vec<_> = std::fs::read_dir(directory.path().join("rig"))
        .expect("a directory")
        .collect();
    assert!(left.is_empty(), "a daemon that ends in order leaves nothing: {left:?}");

    // Its lock does not reach another's file.
    let lock = directory.path().join("rig/control.sock.lock");
    std::os::unix::fs::symlink(directory.path().join("made"), &lock).expect("a link");
    let message = refused(&arguments, 1, &[]);
    assert!(!directory.path().join("made").exists(), "{message}");
    std::fs::remove_file(&lock).expect("it is ours");

    std::fs::write(&socket, "precious").expect("a file");
    refused(&arguments, 1, &["not a socket"]);
    assert_eq!(std::fs::read_to_string(&socket).expect("it is still there"), "precious");
}

// hazard: F19
#[test]
fn every_signal_that_can_end_it_lets_the_force_down_first() {
    // Each whose action is to end a process, but SIGKILL, SIGPIPE, which Rust ignores, and those of a thread's own
    // fault.
    let signals = [
        "HUP", "INT", "QUIT", "USR1", "USR2", "ALRM", "TERM", "STKFLT", "XCPU", "XFSZ", "VTALRM", "PROF", "IO", "PWR",
        "RTMIN", "RTMIN+1", "RTMAX-1", "RTMAX",
    ];
    for signal in signals {
        let daemon = Daemon::start(&["--ramp-ms", "50"]);
        let mut client = daemon.client();
        engage(&mut client);
        if signal == "HUP" && std::fs::File::open("/dev/tty").is_err() {
            // To a service it asks for something else.
            continue;
        }
        let (ended, printed) = daemon.end_by(signal);
        assert!(ended.success(), "{signal}: {ended} {printed}");
        assert!(!printed.contains("panic"), "{signal}: {printed}");
        assert!(
            printed.contains("release"),
            "{signal}: it is released along its ramp: {printed}"
        );
    }
}

#[test]
fn what_cannot_be_run_is_refused_by_its_name() {
    let directory = tempfile::tempdir().expect("a directory");
    let unknown = directory.path().join("unknown.toml");
    std::fs::write(&unknown, "colour = \"red\"\n").expect("written");
    refused(&[], 2, &["--device fake", "--demo"]);
    let limits = ["rate", "50", "100", "20000", "Hz"];
    refused(&["--device", "fake", "--rate", "50"], 2, &limits);
    refused(&["--config", plain(&unknown)], 2, &["unknown.toml", "colour"]);
}

#[test]
fn a_daemon_that_ends_lets_force_out_and_not_in() {
    // Long enough for all that is tried while it lets the force out.
    let daemon = Daemon::start(&["--ramp-ms", "10000"]);
    let mut client = daemon.client();
    engage(&mut client);
    process::signal(daemon.pid(), Signal::TERM);
    wait_for_state(&mut client, RigState::Releasing);
    let refused = client
        .request::<StateReply>(Request::engage())
        .expect_err("it is ending");
    assert!(refused.to_string().contains("ending"), "{refused}");
    // Whoever comes now can still stop it.
    let stopped: StateReply = daemon.client().request(Request::Stop {}).expect("it still serves");
    assert_eq!(stopped.state, RigState::Stopped);
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
}
