//! `haptic-ctl stop` where nobody hears it: what helps then is not another daemon.

use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::net::UnixListener;
use std::process::Output;
use std::time::{Duration, Instant};
use system_tests::{Daemon, ctl};

/// Generous: on a busy machine the program itself takes its time to start.
const SOON: Duration = Duration::from_secs(15);

fn says_to_cut_the_power(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("if the motor pulls, cut its power"), "{said}");
    assert!(said.contains("watchdog"), "{said}");
    assert!(!said.contains("start one"), "{said}");
}

// hazard: H12
#[test]
fn without_a_daemon_a_stop_says_to_cut_the_power() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("control.sock");
    says_to_cut_the_power(&ctl(&socket, &["stop"]), 3);
    // A socket that a dead daemon left behind.
    drop(UnixListener::bind(&socket).expect("a socket"));
    says_to_cut_the_power(&ctl(&socket, &["stop"]), 3);
    let json = ctl(&socket, &["--json", "stop"]);
    assert_eq!(json.status.code(), Some(3));
    let said: serde_json::Value = serde_json::from_slice(&json.stderr).expect("JSON");
    assert!(
        said["error"]["message"]
            .as_str()
            .is_some_and(|text| text.contains("cut its power")),
        "{said}"
    );
    // Anything else is still told how to get one.
    let status = ctl(&socket, &["status"]);
    assert!(
        String::from_utf8_lossy(&status.stderr).contains("start one"),
        "{status:?}"
    );
}

// hazard: H12
#[test]
fn a_stop_that_is_not_answered_says_so_in_time_and_never_hangs() {
    // Connects, and nobody ever greets.
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("control.sock");
    let _listener = UnixListener::bind(&socket).expect("a socket");
    let began = Instant::now();
    says_to_cut_the_power(&ctl(&socket, &["stop"]), 5);
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());

    // A daemon that stands still as a whole.
    let daemon = Daemon::start(&[]);
    let pid = Pid::from_raw(i32::try_from(daemon.pid()).expect("a process")).expect("a process");
    kill_process(pid, Signal::STOP).expect("it runs");
    let began = Instant::now();
    says_to_cut_the_power(&daemon.ctl(&["stop"]), 5);
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
    kill_process(pid, Signal::CONT).expect("it stands");
}

#[test]
fn a_stop_of_a_faulted_rig_says_the_fault() {
    let daemon = Daemon::start(&["--hand", "sine", "--speed-limit-mps", "0.01"]);
    drop(daemon.ctl(&["engage"]));
    daemon.ctl_ok(&["wait", "--until", "state=faulted"]);
    let said = daemon.ctl_ok(&["stop"]);
    assert!(
        said.contains("faulted at tick") && said.contains("speed limit"),
        "{said}"
    );
}
