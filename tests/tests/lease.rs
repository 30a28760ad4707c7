//! A lease: the rig is released when the client that holds it dies or falls silent.

use haptic_ipc::{Client, ErrorCode, LeaseReply, LogReply, Request, RigState, StateReply};
use std::time::{Duration, Instant};
use system_tests::{Daemon, pause, status, wait_for, wait_for_state};

fn lease(client: &mut Client, timeout_ms: u32) -> LeaseReply {
    client.request(Request::Lease { timeout_ms }).expect("a lease")
}

/// An engaged rig: somebody who looks on, and somebody who is to hold a lease.
fn engaged() -> (Daemon, Client, Client) {
    let daemon = Daemon::start(&[]);
    let (mut watcher, mut holder) = (daemon.client(), daemon.client());
    let _: StateReply = holder.request(Request::Engage {}).expect("it is idle");
    wait_for_state(&mut watcher, RigState::Engaged);
    (daemon, watcher, holder)
}

fn lapsed(client: &mut Client) -> Vec<String> {
    let log = Request::Log {
        after: None,
        limit: None,
    };
    let reply: LogReply = client.request(log).expect("the journal");
    let of_leases = reply.entries.into_iter().filter(|entry| entry.op == "lease_lapsed");
    of_leases.filter_map(|entry| entry.message).collect()
}

#[test]
fn a_silent_client_lets_the_force_out_in_its_time_and_not_before() {
    let (_daemon, mut watcher, mut holder) = engaged();
    // So long that a busy machine does not keep this thread silent for it.
    const TIMEOUT: Duration = Duration::from_secs(2);
    assert_eq!(lease(&mut holder, 2000).timeout_ms, 2000);
    let given = Instant::now();
    let mut silent = given;
    // As long as it says anything at all, the rig stays engaged.
    while given.elapsed() < TIMEOUT + TIMEOUT / 2 {
        // The lease begins anew when the daemon reads the request, which is later than this.
        silent = Instant::now();
        assert_eq!(status(&mut holder).state, RigState::Engaged);
        pause();
    }
    wait_for(&mut watcher, "a release", |status| status.state != RigState::Engaged);
    let after = silent.elapsed();
    assert!(after >= TIMEOUT, "released after {after:?}");
    wait_for_state(&mut watcher, RigState::Idle);
    assert_eq!(status(&mut watcher).leases, 0);
    assert_eq!(lapsed(&mut watcher), ["its client has fallen silent"]);
}

#[test]
fn a_client_that_dies_lets_the_force_out_at_once() {
    let (_daemon, mut watcher, mut holder) = engaged();
    lease(&mut holder, 60_000);
    drop(holder);
    wait_for_state(&mut watcher, RigState::Idle);
    assert_eq!(lapsed(&mut watcher), ["its client has closed the connection"]);
}

#[test]
fn a_client_that_ends_its_lease_may_go() {
    let (_daemon, mut watcher, mut holder) = engaged();
    // Ended before it can lapse, also on a busy machine.
    lease(&mut holder, 4000);
    assert_eq!(status(&mut watcher).leases, 1);
    lease(&mut holder, 0);
    drop(holder);
    wait_for(&mut watcher, "a client less", |status| status.clients == 1);
    let begun = status(&mut watcher).tick;
    let later = wait_for(&mut watcher, "longer than the lease", |status| {
        status.tick > begun + 4500
    });
    assert_eq!((later.state, later.leases), (RigState::Engaged, 0));
}

#[test]
fn the_first_of_two_leases_to_lapse_lets_the_force_out() {
    let (daemon, mut watcher, mut holder) = engaged();
    let mut other = daemon.client();
    lease(&mut holder, 60_000);
    lease(&mut other, 100);
    wait_for_state(&mut watcher, RigState::Idle);
    assert_eq!(status(&mut watcher).leases, 1);
    // The one that is left does not keep anybody from engaging again.
    let _: StateReply = watcher.request(Request::Engage {}).expect("it is idle");
    wait_for_state(&mut watcher, RigState::Engaged);
}

#[test]
fn a_lease_shorter_than_a_program_can_keep_is_refused() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    for timeout_ms in [1, 19, 60_001] {
        match client.request::<LeaseReply>(Request::Lease { timeout_ms }) {
            Err(haptic_ipc::ClientError::Refused(error)) => {
                assert_eq!((error.code, error.unit.as_deref()), (ErrorCode::OutOfRange, Some("ms")));
            }
            other => panic!("{other:?}"),
        }
    }
}
