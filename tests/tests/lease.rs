//! A lease: the rig is released when the client that holds it dies or falls silent.

use haptic_ipc::{Client, LeaseReply, Request, RigState};
use serde_json::json;
use std::time::{Duration, Instant};
use system_tests::{Daemon, engage, journal, pause, stalled, status, wait_for, wait_for_state};

fn lease(client: &mut Client, timeout_ms: u32) -> LeaseReply {
    client.request(Request::Lease { timeout_ms }).expect("a lease")
}

/// An engaged rig: somebody who looks on, and somebody who is to hold a lease.
fn engaged() -> (Daemon, Client, Client) {
    let daemon = Daemon::start(&[]);
    let (watcher, mut holder) = (daemon.client(), daemon.client());
    engage(&mut holder);
    (daemon, watcher, holder)
}

fn lapsed(client: &mut Client) -> Vec<String> {
    let of_leases = journal(client).into_iter().filter(|entry| entry.op == "lease_lapsed");
    of_leases.filter_map(|entry| entry.message).collect()
}

#[test]
fn silent_client_releases_force_at_its_timeout_not_before() {
    let (_daemon, mut watcher, mut holder) = engaged();
    // So long that a busy machine does not keep this thread silent for it.
    const TIMEOUT: Duration = Duration::from_secs(2);
    assert_eq!(lease(&mut holder, 2000).timeout_ms, 2000);
    let given = Instant::now();
    let mut silent = given;
    // As long as it says anything at all, the rig stays engaged.
    while given.elapsed() < TIMEOUT + TIMEOUT / 2 {
        // The lease begins again when the daemon reads the request, which is later than this.
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
    let entries = journal(&mut watcher).into_iter();
    let released: Vec<_> = entries
        .filter(|entry| entry.op == "release")
        .map(|entry| entry.message)
        .collect();
    assert_eq!(
        released,
        [Some("a lease has lapsed: its client has fallen silent".to_owned())]
    );
}

// hazard: F4, F20
#[test]
fn client_dying_during_disk_stall_releases_force_at_once() {
    let Some(daemon) = stalled::daemon(&["--hand=free", "--ramp-ms", "20"]) else {
        return;
    };
    let mut watcher = daemon.client();
    let excitation = json!({
        "course": {"kind": "sweep", "travel_m": 0.01, "speed_mps": 0.02, "rounds": 10},
        "force_limit_N": 3, "slew_limit_N_per_s": 200, "stiffness_N_per_m": 1000, "damping_Ns_per_m": 20,
        "travel_limit_m": 0.015, "speed_limit_mps": 0.3, "lag_limit_m": 0.006, "wrong_way_limit_m": 1e-4,
    });
    let mut holder = daemon.raw();
    for request in [
        // It ends the motion too, but later.
        json!({"id": 1, "op": "lease", "timeout_ms": 2000}),
        json!({"id": 2, "op": "identify.begin", "range_m": 0.1}),
        json!({"id": 3, "op": "identify.excite", "excitation": excitation}),
    ] {
        let answer = holder.ask(&request.to_string());
        assert!(answer["ok"].is_object(), "{answer}");
    }
    wait_for_state(&mut watcher, RigState::Engaged);
    // Each waits for two seconds.
    for id in 4..8 {
        holder.send(format!("{{\"id\":{id},\"op\":\"scene.list\"}}\n"));
    }
    drop(holder);
    wait_for(&mut watcher, "the end of it", |status| {
        status.commissioning.is_none() && status.leases == 0 && !status.state.is_live()
    });
    assert_eq!(lapsed(&mut watcher), ["its client has closed the connection"]);
}

// hazard: F4
#[test]
fn engagement_queued_past_lease_expiry_is_refused() {
    let Some(daemon) = stalled::daemon(&[]) else {
        return;
    };
    let mut holder = daemon.raw();
    let leased = holder.ask(r#"{"id":1,"op":"lease","timeout_ms":100}"#);
    assert!(leased["ok"].is_object(), "{leased}");
    holder.send("{\"id\":2,\"op\":\"scene.list\"}\n{\"id\":3,\"op\":\"engage\"}\n");
    assert_eq!(holder.line()["error"]["code"], "scene_file", "the disk answers");
    let refused = holder.line();
    assert_eq!(refused["error"]["code"], "wrong_state", "{refused}");
    let message = refused["error"]["message"].as_str().expect("a message");
    assert!(message.contains("lease"), "{message}");
    assert_eq!(status(&mut daemon.client()).state, RigState::Idle);
    let refused = holder.ask(r#"{"id":4,"op":"engage"}"#);
    assert_eq!(
        refused["error"]["code"], "wrong_state",
        "it has no lease now: {refused}"
    );
    let leased = holder.ask(r#"{"id":5,"op":"lease","timeout_ms":60000}"#);
    assert!(leased["ok"].is_object(), "{leased}");
    let engaged = holder.ask(r#"{"id":6,"op":"engage"}"#);
    assert!(engaged["ok"].is_object(), "it is there again: {engaged}");
}

#[test]
fn an_ended_lease_holds_nobody_and_the_first_to_lapse_all() {
    let (daemon, mut watcher, mut holder) = engaged();
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

    let (mut holder, mut other) = (daemon.client(), daemon.client());
    lease(&mut holder, 60_000);
    lease(&mut other, 100);
    wait_for_state(&mut watcher, RigState::Idle);
    assert_eq!(status(&mut watcher).leases, 1);
    // The one that is left does not keep anybody from engaging again.
    engage(&mut watcher);
}
