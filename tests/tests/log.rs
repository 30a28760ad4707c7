//! What standard error tells of a running daemon, and its journal: the same.

use haptic_ipc::{JournalEntry, Request, RigState, StateReply};
use rustix::process::Signal;
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, journal, until_some, wait_for_state};

fn log(daemon: &Daemon) -> Vec<JournalEntry> {
    journal(&mut daemon.client())
}

/// The journal, once such entries are in it.
fn log_with(daemon: &Daemon, what: &str, wanted: impl Fn(&[JournalEntry]) -> bool) -> Vec<JournalEntry> {
    until_some(&format!("waited in vain for {what}"), || {
        Some(log(daemon)).filter(|entries| wanted(entries))
    })
}

fn count(entries: &[JournalEntry], op: &str) -> usize {
    entries.iter().filter(|entry| entry.op == op).count()
}

// hazard: H18
#[test]
fn journal_and_stderr_word_faults_disconnects_and_stops_alike() {
    let mut rig = FakeRig::start(&[]);
    let daemon = Daemon::start_on(&rig.address(), &[]);
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    // A fault.
    rig.fail("error 3 4711");
    wait_for_state(&mut client, RigState::Faulted);
    // Unplugged while it is faulted, and plugged in again.
    rig.fail("hang-up 0.3");
    log_with(&daemon, "a disconnect", |entries| count(entries, "disconnected") >= 1);
    log_with(&daemon, "a reconnect", |entries| count(entries, "connected") >= 2);
    let _: StateReply = client.request(Request::Reset {}).expect("it is faulted");
    wait_for_state(&mut client, RigState::Idle);
    // Unplugged while it is idle.
    let before = log(&daemon);
    rig.fail("hang-up 0.3");
    log_with(&daemon, "another reconnect", |entries| {
        count(entries, "connected") > count(&before, "connected")
    });
    wait_for_state(&mut client, RigState::Idle);
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    let _: StateReply = client.request(Request::Reset {}).expect("it is stopped");
    // A change of the scene, which is in the journal alone.
    let change = Request::set([("mass", 1.5)].into_iter().collect());
    let _: haptic_ipc::ChangeReply = client.request(change).expect("a change");
    // A lease that lapses.
    let mut holder = daemon.client();
    let _: haptic_ipc::LeaseReply = holder.request(Request::Lease { timeout_ms: 10_000 }).expect("a lease");
    drop(holder);
    let entries = log_with(&daemon, "a lapsed lease", |entries| count(entries, "lease_lapsed") >= 1);

    let ops: Vec<&str> = entries.iter().map(|entry| entry.op.as_str()).collect();
    for op in ["connected", "fault", "disconnected", "reset", "stop", "lease_lapsed"] {
        assert!(ops.contains(&op), "{ops:?} lacks {op}");
    }
    assert_eq!(
        count(&entries, "connected"),
        count(&entries, "disconnected") + 1,
        "each loss and each return is reported once: {ops:?}"
    );
    let connected = entries.iter().find(|entry| entry.op == "connected").expect("it is");
    let message = connected.message.as_deref().unwrap_or_default();
    assert!(
        message.contains("serial line") && message.contains("fake-rig "),
        "{connected:?}"
    );
    let shown = daemon.ctl_ok(&["log", "-n", "2000"]);
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
    assert_eq!(count(&entries, "set"), 1);
    for entry in &entries {
        let line = format!("hapticd: {entry}\n");
        assert_eq!(
            printed.contains(&line),
            entry.op != "set",
            "standard error: {line}{printed}"
        );
        assert!(
            shown.contains(&entry.to_string()),
            "haptic-ctl log lacks {entry}: {shown}"
        );
    }
    let stop = entries.iter().find(|entry| entry.op == "stop").expect("it is");
    assert!(stop.by.is_some() && printed.contains("-> stopped"), "{printed}");
}
