//! Changes that the loop makes in ticks to come: what is refused of them, and what takes them back. Each is rendered in
//! its tick by the loop's own tests, and once through the whole system by `ctl_change.rs`.

use haptic_ipc::{
    ChangeOptions, Changes, Client, ErrorCode, LeaseReply, Request, SceneChange, SceneRef, ScheduleReply,
    ScheduledChange, StateReply, Status,
};
use system_tests::{Daemon, engage, journal, refused, status, wait_for};

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
fn a_schedule_is_taken_whole_or_not_at_all() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let first = status(&mut client).tick + FAR;
    let ramped = |tick, mass, ramp_ms| ScheduledChange {
        ramp_ms: Some(ramp_ms),
        ..at(tick, &[("M", mass)])
    };
    let nowhere = ScheduledChange {
        change: SceneChange::Scene(SceneRef::Name("nowhere".to_owned())),
        ..at(first, &[])
    };
    for (changes, code, parts) in [
        (
            vec![at(first, &[("M", 2.0)]), at(first + 1, &[("M", -2.0)])],
            ErrorCode::OutOfRange,
            vec!["changes[1]", "mass", "-2"],
        ),
        (
            vec![ramped(first, 2.0, 100.0), at(first + 99, &[("M", 3.0)])],
            ErrorCode::OutOfRange,
            vec!["with its ramp"],
        ),
        (
            (0..20_u8)
                .map(|step| ramped(first + 1000 * u64::from(step), 2.0 + f64::from(step), 1000.0))
                .collect(),
            ErrorCode::OutOfRange,
            vec!["2000 compiled scenes"],
        ),
        (vec![nowhere], ErrorCode::NoSuchScene, vec!["changes[0]", "nowhere"]),
    ] {
        let error = refused(&mut client, schedule(changes, false));
        assert_eq!(error.code, code, "{error}");
        for part in parts {
            assert!(error.message.contains(part), "{error} lacks {part}");
        }
        assert_eq!(waiting(&status(&mut client)), 0);
    }
    // As many as there is room for, and one more.
    let many = (0..=255_u8).map(|step| at(first + u64::from(step), &[("M", 1.0 + 0.1 * f64::from(step))]));
    let _: ScheduleReply = client.request(schedule(many.collect(), false)).expect("there is room");
    let one_more = Request::Set {
        params: [("M", 1.0)].into_iter().collect(),
        merge: false,
        options: ChangeOptions {
            at_tick: Some(first + 300),
            anyway: true,
            ..ChangeOptions::default()
        },
    };
    assert_eq!(refused(&mut client, one_more).code, ErrorCode::OutOfRange);
    assert_eq!(waiting(&status(&mut client)), 256);
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
