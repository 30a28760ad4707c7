//! `haptic-ctl stop` where nobody receives it: what helps then is not another daemon.

use rustix::process::Signal;
use std::io::Write;
use std::os::unix::net::UnixListener;
use std::process::Output;
use std::time::{Duration, Instant};
use system_tests::{Daemon, ctl, is_refused, process};

/// Generous: on a busy machine the program itself takes its time to start.
const SOON: Duration = Duration::from_secs(15);

fn says_to_cut_the_power(output: &Output, code: i32) {
    let message = is_refused("stop", output, code, &["if the motor pulls, cut its power", "watchdog"]);
    assert!(!message.contains("start one"), "{message}");
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
    says_to_cut_the_power(&ctl(&socket, &["--json", "stop"]), 3);
    // Any other command still names how to get one.
    is_refused("status", &ctl(&socket, &["status"]), 3, &["start one"]);
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

    // Greets, and then says nothing.
    let mute = directory.path().join("mute.sock");
    let listener = UnixListener::bind(&mute).expect("a socket");
    let greeted = std::thread::spawn(move || {
        let (mut client, _) = listener.accept().expect("a client");
        let greeting = b"{\"hello\":{\"protocol\":1,\"server\":\"mute\",\"session\":\"1\"}}\n";
        client.write_all(greeting).expect("it reads");
        client
    });
    says_to_cut_the_power(&ctl(&mute, &["stop"]), 5);
    drop(greeted.join());

    // A daemon that stands still as a whole.
    let daemon = Daemon::start(&[]);
    process::signal(daemon.pid(), Signal::STOP);
    let began = Instant::now();
    says_to_cut_the_power(&daemon.ctl(&["stop"]), 5);
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
    process::signal(daemon.pid(), Signal::CONT);
}

#[test]
fn a_stop_of_a_faulted_rig_says_the_fault() {
    let daemon = Daemon::start(&["--hand", "sine", "--speed-limit-mps", "0.01"]);
    drop(daemon.ctl(&["engage"]));
    daemon.ctl_ok(&["wait", "--until", "state=faulted"]);
    let printed = daemon.ctl_ok(&["stop"]);
    assert!(
        printed.contains("faulted at tick") && printed.contains("speed limit"),
        "{printed}"
    );
}
