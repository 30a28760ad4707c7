//! How a daemon comes and goes: sockets, configuration, privileges, signals.

use haptic_ipc::{Request, RigState, StateReply};
use rustix::process::Signal;
use std::process::{Command, Stdio};
use system_tests::{Daemon, binary, process, status, stderr, wait_for_state};

/// Runs hapticd with arguments with which it cannot run; returns its exit code and its message.
fn refused(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(binary("hapticd"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("hapticd starts");
    (output.status.code(), stderr(&output))
}

#[test]
fn a_socket_in_use_is_refused_and_a_stale_one_is_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("rig/control.sock");
    let path = socket.to_str().expect("a plain path");
    let first = Daemon::start_at(&socket, &[]);
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains(path) && message.contains("in use"), "{message}");
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
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(!directory.path().join("made").exists(), "{message}");
    std::fs::remove_file(&lock).expect("it is ours");

    std::fs::write(&socket, "precious").expect("a file");
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("not a socket"), "{message}");
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
        system_tests::engage(&mut client);
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
    let file = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.to_str().expect("a plain path").to_owned()
    };
    let unknown = file("unknown.toml", "colour = \"red\"\n");
    for (arguments, parts) in [
        (vec![], vec!["--device fake", "--demo"]),
        (
            vec!["--device", "fake", "--rate", "50"],
            vec!["rate", "50", "100", "20000", "Hz"],
        ),
        (vec!["--config", &unknown], vec!["unknown.toml", "colour"]),
    ] {
        let (code, message) = refused(&arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {message}");
        for part in parts {
            assert!(message.contains(part), "{arguments:?}: {message} lacks {part}");
        }
        assert!(!message.contains("panicked"), "{message}");
    }
}

#[test]
fn a_daemon_that_ends_lets_force_out_and_not_in() {
    // Long enough for all that is tried while it lets the force out.
    let daemon = Daemon::start(&["--ramp-ms", "10000"]);
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
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
