//! Changes that the loop makes in ticks to come: what is refused of them, and what takes them back. Each is rendered in
//! its tick by the loop's own tests, and once through the whole system by `ctl_change.rs`.

use haptic_ipc::{
    Changes, Client, LeaseReply, Request, SceneChange, ScheduleReply, ScheduledChange, StateReply, Status,
};
use system_tests::{Daemon, engage, journal, status, wait_for};

/// Ticks ahead at which a test's change waits: no test takes as long.
const FAR: u64 = 1_000_000;

fn at(tick: u64, changes: &[(&str, f64)]) -> ScheduledChange {
    ScheduledChange {
        at_tick: tick,
        change: SceneChange::Params(changes.iter().copied().collect::<Changes>()),
        ramp_ms: None,
    }
}

/// Anyway: on a busy machine trials take the time that they are asked ahead of.
fn schedule(changes: Vec<ScheduledChange>, keep: bool) -> Request {
    Request::Schedule {
        changes,
        name: Some("a".to_owned()),
        keep,
        if_revision: None,
        dry_run: false,
        anyway: true,
    }
}

fn waiting(status: &Status) -> usize {
    status.scheduled.as_ref().map_or(0, |scheduled| scheduled.waiting)
}

#[test]
fn stop_or_client_end_cancels_schedule_but_release_does_not() {
    let daemon = Daemon::start(&[]);
    let mut watcher = daemon.client();
    let first = status(&mut watcher).tick + FAR;
    let scheduled = |keep| {
        let mut client = daemon.client();
        let _: ScheduleReply = client
            .request(schedule(vec![at(first, &[("M", 2.0)])], keep))
            .expect("it is accepted");
        client
    };
    let cancelled = |watcher: &mut Client, why: &str| {
        wait_for(watcher, "no schedule", |status| waiting(status) == 0);
        let newest = journal(watcher)
            .into_iter()
            .rfind(|entry| entry.op == "schedule_cancelled")
            .expect("the journal says so");
        assert!(
            newest.message.as_ref().is_some_and(|text| text.contains(why)),
            "{newest}"
        );
    };
    // Its client closes its connection.
    drop(scheduled(false));
    cancelled(&mut watcher, "closed the connection");

    // Its client falls silent.
    let mut silent = scheduled(false);
    let _: LeaseReply = silent.request(Request::Lease { timeout_ms: 20 }).expect("a lease");
    cancelled(&mut watcher, "fallen silent");
    drop(silent);

    // A release leaves it, as does the end of a client that asked for that.
    let mut keeper = scheduled(true);
    engage(&mut keeper);
    let _: StateReply = keeper.request(Request::Release {}).expect("it is engaged");
    drop(keeper);
    wait_for(&mut watcher, "one client", |status| status.clients == 1);
    assert_eq!(waiting(&status(&mut watcher)), 1);

    // A stop does not.
    let _: StateReply = watcher.request(Request::Stop {}).expect("always");
    cancelled(&mut watcher, "stopped");
    let _: StateReply = watcher.request(Request::Reset {}).expect("it is stopped");
    assert_eq!(status(&mut watcher).revision, 1, "nothing of it was rendered");
}
