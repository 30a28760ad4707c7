//! A stop and a signal work while every output of the daemon is blocked.

use haptic_ipc::{Client, Request, RigState, StateReply};
use rustix::process::Signal;
use std::path::Path;
use std::time::{Duration, Instant};
use system_tests::blocked::{Blocked, Mute};
use system_tests::{Daemon, HeldThread, PATIENCE, engage, process, until, until_some, wait_for, wait_for_state};

/// Asks for something on a thread of its own, since a daemon that hangs never answers; returns the
/// state and how long it took.
fn asked(socket: &Path, request: Request) -> (RigState, Duration) {
    let (answer, answered) = std::sync::mpsc::channel();
    let socket = socket.to_path_buf();
    std::thread::spawn(move || {
        let mut client = Client::connect(&socket).expect("it serves");
        let began = Instant::now();
        let reply: StateReply = client.request(request).expect("it is answered");
        answer.send((reply.state, began.elapsed())).expect("somebody waits");
    });
    answered.recv_timeout(PATIENCE).expect("the daemon does not answer")
}

/// Longest that a stop or an end may take, beyond the ramp, on a machine as busy as any.
const LIMIT: Duration = Duration::from_secs(5);

/// Engages the rig of a daemon with blocked outputs, lets it say more than fits into its queues,
/// stops it, and ends it.
fn holds(what: &str, arguments: &[&str], blocked: impl Fn() -> Blocked) {
    for signal in [Signal::TERM, Signal::INT] {
        let output = blocked();
        let mut daemon = Mute::start(&[arguments, &["--ramp-ms", "50"]].concat(), Some(&output));
        let mut client = daemon.client();
        let (state, _) = asked(&daemon.socket, Request::engage());
        assert!(state.is_live(), "{state}");
        // More lines than the queue takes: each of these is one.
        for _ in 0..300 {
            // Refused where a busy machine has faulted the rig; that is a line as well.
            drop(client.request::<StateReply>(Request::engage()));
        }
        engage(&mut client);
        // And more status lines of the demo than the output would take.
        let from = system_tests::status(&mut client).tick;
        wait_for(&mut client, "two seconds", |status| status.tick > from + 2000);
        assert!(!output.takes_something(), "it is still blocked");
        let (state, stop_took) = asked(&daemon.socket, Request::Stop {});
        assert_eq!(state, RigState::Stopped);
        // And while force flows.
        let _: StateReply = client.request(Request::Reset {}).expect("it was stopped");
        engage(&mut client);
        let began = Instant::now();
        process::signal(daemon.child.id(), signal);
        let ended = until_some("it does not end", || daemon.child.try_wait().expect("it is ours"));
        let end_took = began.elapsed();
        println!("{what}: stop confirmed after {stop_took:?}, {signal:?} ended it after {end_took:?}");
        assert!(ended.success(), "{what}, {signal:?}: {ended} after {end_took:?}");
        assert!(stop_took < LIMIT && end_took < LIMIT, "{stop_took:?} {end_took:?}");
    }
}

// hazard: H1
#[test]
fn stop_and_signal_work_with_blocked_outputs() {
    for arguments in [&["--device", "fake"][..], &["--demo"]] {
        holds(&format!("{arguments:?}, a full pipe"), arguments, Blocked::pipe);
        holds(&format!("{arguments:?}, a held terminal"), arguments, Blocked::terminal);
    }
}

// hazard: H1, H2
#[test]
fn a_signal_ends_a_daemon_whose_control_thread_hangs() {
    let daemon = Daemon::start(&["--ramp-ms", "50"]);
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    let held = HeldThread::control(daemon.pid());
    let began = Instant::now();
    process::signal(daemon.pid(), Signal::TERM);
    until("it does not end", || held.is_killed());
    let took = began.elapsed();
    println!("with the control thread held: ended after {took:?}");
    assert!(took < LIMIT, "{took:?}");
}
