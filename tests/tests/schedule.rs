//! Changes that the loop makes in ticks to come.

use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Client, ClientError, ErrorCode, Event, JournalEntry, LeaseReply, LogReply,
    Request, RigState, SceneChange, SceneRef, ScheduleCancelReply, ScheduleReply, ScheduledChange, StateReply, Status,
    SubscribeReply, Topic, WireError,
};
use std::collections::BTreeMap;
use std::sync::mpsc;
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, engage, status, timed, wait_for, wait_for_state};

/// Ticks between two changes of the staircase.
const STEP: u64 = 4;

// What is asked for is asked for anyway: on a busy machine trials take the time that they are asked ahead of.

/// Ticks ahead at which a test's far change waits: no test takes as long.
const FAR: u64 = 1_000_000;

fn params(changes: &[(&str, f64)]) -> Changes {
    changes.iter().copied().collect()
}

fn at(tick: u64, changes: &[(&str, f64)]) -> ScheduledChange {
    ScheduledChange {
        at_tick: tick,
        change: SceneChange::Params(params(changes)),
        ramp_ms: None,
    }
}

fn schedule(changes: Vec<ScheduledChange>, name: &str, keep: bool) -> Request {
    Request::Schedule {
        changes,
        name: Some(name.to_owned()),
        keep,
        if_revision: None,
        dry_run: false,
        anyway: true,
    }
}

fn set_at(tick: u64, changes: &[(&str, f64)]) -> Request {
    Request::Set {
        params: params(changes),
        merge: false,
        options: ChangeOptions {
            at_tick: Some(tick),
            anyway: true,
            ..ChangeOptions::default()
        },
    }
}

fn refused(client: &mut Client, request: Request) -> WireError {
    match client.request::<serde_json::Value>(request) {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{other:?}"),
    }
}

fn waiting(status: &Status) -> usize {
    status.scheduled.as_ref().map_or(0, |scheduled| scheduled.waiting)
}

fn log(client: &mut Client) -> Vec<JournalEntry> {
    let request = Request::Log {
        after: None,
        limit: Some(2000),
    };
    let reply: LogReply = client.request(request).expect("the journal");
    reply.entries
}

/// Ticks ahead at which the changes are rendered that a test waits for: no machine is slower to ask for them.
fn ahead() -> u64 {
    test_run::extent(6000, 15_000)
}

/// A subscriber to every tick up to a last revision, which tells in which tick each revision was first, where it saw the
/// tick before as well: on a busy machine some are dropped.
fn subscriber(daemon: &Daemon, last_revision: u64) -> mpsc::Receiver<BTreeMap<u64, u64>> {
    let mut client = daemon.client();
    let subscribe = Request::Subscribe {
        topics: vec![Topic::Samples],
        rate_hz: None,
        batch_ms: None,
    };
    let _: SubscribeReply = client.request(subscribe).expect("a subscription");
    let (told, heard) = mpsc::channel();
    std::thread::spawn(move || {
        let mut first_ticks: BTreeMap<u64, u64> = BTreeMap::new();
        let mut newest = (0, 0);
        while newest.1 < last_revision {
            if let Event::Samples(batch) = client.next_event().expect("the daemon goes on") {
                for row in batch.rows {
                    if row.tick == newest.0 + 1 && row.revision != newest.1 {
                        first_ticks.insert(row.revision, row.tick);
                    }
                    newest = (row.tick, row.revision);
                }
            }
        }
        told.send(first_ticks).expect("the test waits");
    });
    heard
}

#[test]
fn a_staircase_is_rendered_tick_by_tick_beside_subscribers() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    engage(&mut client);
    let steps = test_run::extent(50, 250);
    let mass = |step: u64| 0.5 + 0.01 * (step + 1) as f64;
    let last = 1 + 2 * steps;
    let subscribers: Vec<_> = (0..test_run::extent(4, 16))
        .map(|_| subscriber(&daemon, last))
        .collect();
    let ticks = |first: u64| (0..steps).map(move |step| first + STEP * step);

    let first = status(&mut client).tick + ahead();
    let changes = ticks(first).zip(0..).map(|(tick, step)| at(tick, &[("M", mass(step))]));
    let scheduled: ScheduleReply = client
        .request(schedule(changes.collect(), "staircase", false))
        .expect("it is asked in time");
    let revisions: Vec<u64> = scheduled.changes.iter().map(|change| change.revision).collect();
    assert_eq!(revisions, (2..2 + steps).collect::<Vec<u64>>());
    let mut wanted: BTreeMap<u64, u64> = revisions.into_iter().zip(ticks(first)).collect();
    // Asked without pause: also in the moment in which a change is rendered.
    while status(&mut client).revision < 1 + steps {}

    // And the same a step a request.
    let first = status(&mut client).tick + ahead();
    let answers: Vec<ChangeReply> = ticks(first)
        .zip(0..)
        .map(|(tick, step)| {
            client
                .request(set_at(tick, &[("M", mass(step) + 4.0)]))
                .expect("in time")
        })
        .collect();
    for (answer, tick) in answers.iter().zip(ticks(first)) {
        assert_eq!((answer.changed, answer.at_tick, answer.tick), (true, Some(tick), None));
        wanted.insert(answer.revision, tick);
    }
    assert_eq!(answers.last().map(|answer| answer.revision), Some(last));
    for heard in subscribers {
        let first_ticks = heard.recv().expect("it hears the last of it");
        println!("{} of {} were seen", first_ticks.len(), wanted.len());
        assert!(first_ticks.len() > wanted.len() / 4, "{first_ticks:?}");
        for (revision, tick) in first_ticks {
            assert_eq!(wanted.get(&revision), Some(&tick), "each in its tick, error 0");
        }
    }

    // The journal says the true tick of each, by whom, and of which schedule.
    wait_for(&mut client, "the end", |status| waiting(status) == 0);
    let entries: Vec<JournalEntry> = log(&mut client).into_iter().filter(|entry| entry.op == "set").collect();
    let told: BTreeMap<u64, u64> = entries
        .iter()
        .map(|entry| (entry.revision, entry.tick.expect("it was rendered")))
        .collect();
    assert_eq!(told, wanted);
    for entry in &entries {
        assert_eq!(entry.at_tick, entry.tick);
        let by = entry.by.as_ref().expect("a client");
        assert_eq!(by.session, client.hello().session);
        let of_schedule = entry.revision <= 1 + steps;
        assert_eq!(entry.schedule.as_deref(), of_schedule.then_some("staircase"));
    }
    // Each is a step of the history.
    let undone: ChangeReply = client.request(Request::undo()).expect("a step back");
    assert_eq!(
        (undone.revision, undone.applied["mass"]),
        (last + 1, mass(steps - 2) + 4.0)
    );
}

#[test]
fn nothing_interleaves_schedule_and_any_client_may_cancel_it() {
    let daemon = Daemon::start(&[]);
    let (mut ada, mut bob) = (daemon.client(), daemon.client());
    let first = status(&mut ada).tick + FAR;
    let _: ChangeReply = ada.request(Request::set(params(&[("M", 1.0)]))).expect("a change");
    let _: ScheduleReply = ada
        .request(schedule(
            vec![at(first, &[("M", 2.0)]), at(first + 9, &[("Fs", 5.0)])],
            "a",
            false,
        ))
        .expect("it is accepted");
    let _: ScheduleReply = ada
        .request(schedule(vec![at(first + 10, &[("M", 3.0)])], "b", false))
        .expect("it goes on");
    for client in [&mut ada, &mut bob] {
        for request in [
            Request::set(params(&[("M", 7.0)])),
            Request::load(SceneRef::Name("lugre".to_owned())),
            Request::undo(),
        ] {
            let error = refused(client, request);
            assert_eq!(error.code, ErrorCode::Scheduled);
            assert!(
                error.message.contains(&format!("from tick {first} to {}", first + 10)),
                "{error}"
            );
        }
        let same: ChangeReply = client.request(Request::set(params(&[("M", 1.0)]))).expect("a no-op");
        assert!(!same.changed);
    }
    assert_eq!(
        refused(&mut bob, set_at(first + 20, &[("M", 4.0)])).code,
        ErrorCode::Scheduled
    );
    let kept_name = refused(&mut ada, schedule(vec![at(first + 20, &[("M", 4.0)])], "a", false));
    assert_eq!(kept_name.code, ErrorCode::BadName);

    // Each builds on the one before it: the later schedule goes with the earlier one.
    let cancel = |name: &str| Request::ScheduleCancel {
        name: Some(name.to_owned()),
    };
    let b: ScheduleCancelReply = bob.request(cancel("b")).expect("it waits");
    assert_eq!((b.cancelled, waiting(&status(&mut bob))), (1, 2));
    let _: ScheduleReply = ada
        .request(schedule(vec![at(first + 30, &[("M", 3.0)])], "b", false))
        .expect("there is room again");
    let a: ScheduleCancelReply = bob.request(cancel("a")).expect("it waits");
    assert_eq!((a.cancelled, waiting(&status(&mut bob))), (3, 0));
    assert_eq!(refused(&mut bob, cancel("a")).code, ErrorCode::NoSuchSchedule);
    let set: ChangeReply = bob
        .request(Request::set(params(&[("M", 7.0)])))
        .expect("the way is free");
    assert_eq!(set.revision, 3, "what was taken back took no revision");
}

#[test]
fn a_schedule_is_taken_whole_or_not_at_all() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let first = status(&mut client).tick + FAR;
    let ramped = ScheduledChange {
        ramp_ms: Some(100.0),
        ..at(first, &[("M", 2.0)])
    };
    for (changes, code, parts) in [
        (
            vec![at(first, &[("M", 2.0)]), at(first + 1, &[("M", -2.0)])],
            ErrorCode::OutOfRange,
            vec!["changes[1]", "mass", "-2"],
        ),
        (
            vec![at(first, &[("M", 2.0)]), at(first, &[("M", 3.0)])],
            ErrorCode::OutOfRange,
            vec!["at_tick"],
        ),
        (
            vec![at(1, &[("M", 2.0)]), at(first, &[("M", 3.0)])],
            ErrorCode::OutOfRange,
            vec!["at_tick = 1 ", "it must be from"],
        ),
        (
            vec![at(first + 1_000_000_000, &[("M", 2.0)])],
            ErrorCode::OutOfRange,
            vec!["at_tick", "to "],
        ),
        (
            vec![ramped, at(first + 99, &[("M", 3.0)])],
            ErrorCode::OutOfRange,
            vec!["with its ramp"],
        ),
        (
            (0..20)
                .map(|step| ScheduledChange {
                    ramp_ms: Some(1000.0),
                    ..at(first + 1000 * step, &[("M", 2.0 + step as f64)])
                })
                .collect(),
            ErrorCode::OutOfRange,
            vec!["2000 compiled scenes"],
        ),
        (
            vec![ScheduledChange {
                at_tick: first,
                change: SceneChange::Scene(SceneRef::Name("nowhere".to_owned())),
                ramp_ms: None,
            }],
            ErrorCode::NoSuchScene,
            vec!["changes[0]", "nowhere"],
        ),
    ] {
        let error = refused(&mut client, schedule(changes, "a", false));
        assert_eq!(error.code, code, "{error}");
        for part in parts {
            assert!(error.message.contains(part), "{error} lacks {part}");
        }
        assert_eq!(waiting(&status(&mut client)), 0);
    }
    // As many as there is room for, and one more.
    let many = |count: u64| {
        (0..count)
            .map(|step| at(first + step, &[("M", 1.0 + 0.1 * step as f64)]))
            .collect()
    };
    let _: ScheduleReply = client.request(schedule(many(256), "a", false)).expect("there is room");
    assert_eq!(
        refused(&mut client, set_at(first + 300, &[("M", 1.0)])).code,
        ErrorCode::OutOfRange
    );
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
            .request(schedule(vec![at(first, &[("M", 2.0)])], "a", keep))
            .expect("it is accepted");
        client
    };
    let cancelled = |watcher: &mut Client, why: &str| {
        wait_for(watcher, "no schedule", |status| waiting(status) == 0);
        let newest = log(watcher)
            .into_iter()
            .rfind(|entry| entry.op == "schedule_cancelled")
            .expect("the journal says so");
        assert!(
            newest.message.as_ref().is_some_and(|said| said.contains(why)),
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

    // A release leaves it, as does the end of a client that said so.
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

#[test]
fn fault_or_unplugging_cancels_schedule_and_next_one_runs() {
    timed("a schedule after a fault", || {
        let mut rig = FakeRig::start(&[]);
        let daemon = Daemon::start_on(&rig.address(), &["--ramp-ms", "20", "--stale-ms", "200"]);
        let mut client = daemon.client();
        for (fault, after) in [
            ("stall 0.4", RigState::Faulted),
            ("hang-up 0.3", RigState::Disconnected),
        ] {
            wait_for_state(&mut client, RigState::Idle);
            engage(&mut client);
            let revision = status(&mut client).revision;
            let first = status(&mut client).tick + FAR;
            let changes = vec![at(first, &[("M", 2.0)]), at(first + 5, &[("M", 3.0)])];
            let _: ScheduleReply = client.request(schedule(changes, "far", true)).expect("it is accepted");
            rig.fail(fault);
            let lost = wait_for(&mut client, "no schedule", |status| waiting(status) == 0);
            assert_eq!(lost.revision, revision, "{fault}: nothing of it was rendered");
            let told = log(&mut client)
                .into_iter()
                .rfind(|entry| entry.op == "schedule_cancelled");
            let told = told.and_then(|entry| entry.message).unwrap_or_default();
            assert!(
                told.starts_with("2 scheduled changes") && told.contains("faulted or disconnected"),
                "{told}"
            );
            if lost.state == after {
                // Or it has come back by now.
                let error = client.request::<ScheduleReply>(schedule(vec![at(first, &[("M", 2.0)])], "late", true));
                match error {
                    Err(ClientError::Refused(error)) => {
                        assert!(
                            matches!(error.code, ErrorCode::Faulted | ErrorCode::WrongState),
                            "{fault}: {error}"
                        );
                    }
                    _ => drop(client.request::<ScheduleCancelReply>(Request::ScheduleCancel { name: None })),
                }
            }
            let mut person = daemon.client();
            wait_for(&mut client, "a rig that was reset", |status| {
                if status.state == RigState::Faulted {
                    // Refused until the device answers again.
                    drop(person.request::<StateReply>(Request::Reset {}));
                }
                status.state == RigState::Idle
            });
            // Nothing of the old schedule keeps the next change from its tick.
            let tick = status(&mut client).tick + ahead();
            let reply: ChangeReply = client
                .request(set_at(tick, &[("M", 1.5)]))
                .expect("it is asked in time");
            assert_eq!(reply.revision, revision + 1);
            wait_for(&mut client, "the end of the schedule", |status| waiting(status) == 0);
            assert_eq!(status(&mut client).revision, revision + 1);
            let rendered = log(&mut client)
                .into_iter()
                .rfind(|entry| entry.op == "set")
                .expect("an entry");
            assert_eq!(rendered.tick, Some(tick));
            let _: ChangeReply = client.request(Request::set(params(&[("M", 0.5)]))).expect("a change");
        }
    });
}
