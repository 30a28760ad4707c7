//! How the scene changes, by whom, and back again.

use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Client, ClientError, ErrorCode, Event, JournalEntry, LogReply, Request,
    Sample, SceneRef, SceneReply, StateReply, SubscribeReply, Topic,
};
use system_tests::{Daemon, engage, status, wait_for, wait_for_state};

fn params(changes: &[(&str, f64)]) -> Changes {
    changes.iter().copied().collect()
}

fn mass(client: &mut Client) -> f64 {
    let reply: SceneReply = client.request(Request::get()).expect("the scene");
    reply.params["mass"].positive
}

fn change(client: &mut Client, request: Request) -> ChangeReply {
    client.request(request).expect("it is accepted")
}

fn refused(client: &mut Client, request: Request) -> haptic_ipc::WireError {
    match client.request::<ChangeReply>(request) {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{other:?}"),
    }
}

fn log(client: &mut Client) -> Vec<JournalEntry> {
    let request = Request::Log {
        after: None,
        limit: Some(2000),
    };
    let reply: LogReply = client.request(request).expect("the journal");
    reply.entries
}

#[test]
fn undo_reverts_another_clients_change() {
    let daemon = Daemon::start(&[]);
    let (mut ada, mut bob) = (daemon.client(), daemon.client());
    let first = change(&mut ada, Request::set(params(&[("M", 1.5), ("Fs+", 5.0)])));
    change(&mut bob, Request::set(params(&[("M", 2.0)])));
    assert_eq!(mass(&mut ada), 2.0);
    let undone = change(&mut ada, Request::undo());
    assert_eq!(
        (undone.revision, mass(&mut bob)),
        (4, 1.5),
        "a step back is a change too"
    );
    change(&mut ada, Request::undo());
    assert_eq!(mass(&mut bob), 0.5);
    assert_eq!(refused(&mut ada, Request::undo()).code, ErrorCode::NothingToUndo);
    change(&mut bob, Request::redo());
    let again = change(&mut bob, Request::redo());
    assert_eq!((mass(&mut ada), again.applied["mass"]), (2.0, 2.0));
    assert_eq!(refused(&mut bob, Request::redo()).code, ErrorCode::NothingToRedo);
    assert_eq!((status(&mut ada).undo_depth, status(&mut ada).redo_depth), (2, 0));

    let entries = log(&mut ada);
    let ops: Vec<&str> = entries.iter().map(|entry| entry.op.as_str()).collect();
    assert_eq!(ops, ["set", "set", "undo", "undo", "redo", "redo"]);
    let sessions: Vec<&str> = entries
        .iter()
        .map(|entry| entry.by.as_ref().expect("a client").session.as_str())
        .collect();
    let (ada, bob) = (ada.hello().session.as_str(), bob.hello().session.as_str());
    assert_eq!(sessions, [ada, bob, ada, ada, bob, bob]);
    let uid = rustix::process::geteuid().as_raw();
    assert!(
        entries
            .iter()
            .all(|entry| entry.by.as_ref().is_some_and(|by| by.uid == uid))
    );
    assert_eq!(entries[0].tick, first.tick);
    let said: Vec<String> = entries[0].changes.iter().map(ToString::to_string).collect();
    assert_eq!(said, ["mass: 0.5 kg -> 1.5 kg", "static_force: 4 N -> +5 -4 N"]);
    assert!(
        entries
            .windows(2)
            .all(|pair| pair[0].time_unix_s <= pair[1].time_unix_s && pair[0].seq + 1 == pair[1].seq)
    );
}

#[test]
fn what_is_dragged_goes_back_in_one_step() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    for step in 0..20 {
        let request = Request::Set {
            params: params(&[("M", 1.0 + f64::from(step))]),
            merge: step > 0,
            options: ChangeOptions::default(),
        };
        change(&mut client, request);
    }
    change(&mut client, Request::undo());
    assert_eq!(mass(&mut client), 0.5);
}

#[test]
fn what_is_so_already_is_no_change() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let heavier = || Request::set(params(&[("M", 1.5)]));
    assert!(change(&mut client, heavier()).changed);
    change(&mut client, Request::set(params(&[("Fs", 5.0)])));
    change(&mut client, Request::undo());
    for nothing in [heavier(), Request::set(Changes::default())] {
        let reply = change(&mut client, nothing);
        assert_eq!((reply.revision, reply.changes.len()), (4, 0));
        assert_eq!(
            (reply.changed, reply.tick),
            (false, None),
            "no tick has rendered anything new"
        );
    }
    assert_eq!(log(&mut client).len(), 3);
    let redone = change(&mut client, Request::redo());
    assert_eq!((redone.revision, redone.applied["static_force"]), (5, 5.0));
    // A ramp that is still going is cut short by the same value at once.
    let slowly = Request::Set {
        params: params(&[("M", 3.0)]),
        merge: false,
        options: ChangeOptions {
            ramp_ms: Some(10_000.0),
            ..ChangeOptions::default()
        },
    };
    // Steps are taken slowly only where there is force.
    engage(&mut client);
    change(&mut client, slowly);
    let at_once = change(&mut client, Request::set(params(&[("M", 3.0)])));
    assert_eq!(at_once.revision, 7);
}

#[test]
fn change_on_an_old_revision_is_refused() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let set = |if_revision, dry_run, mass| Request::Set {
        params: params(&[("M", mass)]),
        merge: false,
        options: ChangeOptions {
            if_revision,
            dry_run,
            ..ChangeOptions::default()
        },
    };
    change(&mut client, set(Some(1), false, 1.0));
    let error = refused(&mut client, set(Some(1), false, 2.0));
    assert_eq!(
        (error.code, error.value, error.min),
        (ErrorCode::Conflict, Some(1.0), Some(2.0))
    );
    let tried = change(&mut client, set(Some(2), true, 3.0));
    assert_eq!((tried.revision, tried.tick, tried.dry_run), (2, None, true));
    assert_eq!(tried.changes[0].to_string(), "mass: 1 kg -> 3 kg");
    assert_eq!(refused(&mut client, set(None, true, -3.0)).code, ErrorCode::OutOfRange);
    assert_eq!((mass(&mut client), log(&mut client).len()), (1.0, 1));
}

#[test]
fn thousand_pipelined_changes_are_answered_in_order() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let mut client = daemon.client();
    for burst in 0..20 {
        let lines: String = (0..50)
            .map(|step| {
                let id = 50 * burst + step;
                format!(
                    "{{\"id\":{id},\"op\":\"set\",\"params\":{{\"M\":{}}}}}\n",
                    1.0 + 0.01 * f64::from(id)
                )
            })
            .collect();
        raw.send(lines);
        let mut last_tick = 0;
        for step in 0..50 {
            let (answer, id) = (raw.line(), 50 * burst + step);
            assert_eq!(
                (&answer["id"], &answer["ok"]["revision"]),
                (&id.into(), &(id + 2).into()),
                "{answer}"
            );
            let tick = answer["ok"]["tick"].as_u64().expect("it was rendered");
            assert!(tick >= last_tick);
            last_tick = tick;
        }
    }
    assert!((mass(&mut client) - 10.99).abs() < 1e-12);
    assert_eq!(log(&mut client).len(), 1000, "each is in the journal");
}

#[test]
fn changes_of_a_vanished_client_stay_in_the_journal() {
    let daemon = Daemon::start(&["--rate", "100"]);
    let mut watcher = daemon.client();
    let mut raw = daemon.raw();
    raw.send("{\"id\":1,\"op\":\"set\",\"params\":{\"M\":3}}\n{\"id\":2,\"op\":\"set\",\"params\":{\"M\":4}}\n");
    drop(raw);
    wait_for(&mut watcher, "both changes", |status| status.revision == 3);
    wait_for(&mut watcher, "a client less", |status| status.clients == 1);
    let entries = loop {
        let entries = log(&mut watcher);
        if entries.len() == 2 {
            break entries;
        }
    };
    assert!(entries.iter().all(|entry| entry.tick.is_some()));
}

#[test]
fn ramp_moves_force_evenly_and_next_change_continues_from_it() {
    // The hand goes steadily for eight seconds and more, one way.
    let daemon = Daemon::start(&[
        "--hand-frequency-hz",
        "0.05",
        "--hand-amplitude-m",
        "0.4",
        "--encoder-resolution-m",
        "0",
    ]);
    let (mut client, mut listener) = (daemon.client(), daemon.client());
    let subscribe = Request::Subscribe {
        topics: vec![Topic::Samples],
        rate_hz: None,
        batch_ms: None,
    };
    // Drag in proportion to speed: the force tells the parameter of the moment.
    change(&mut client, Request::load(SceneRef::Name("viscous-drag".to_owned())));
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, haptic_ipc::RigState::Engaged);
    // Its velocity is what the force is divided by.
    wait_for(&mut client, "a hand that moves", |status| status.tick >= 1000);
    let _: SubscribeReply = listener.request(subscribe).expect("a subscription");
    let set = |drag, ramp_ms| Request::Set {
        params: params(&[("b", drag)]),
        merge: false,
        options: ChangeOptions {
            ramp_ms: Some(ramp_ms),
            ..ChangeOptions::default()
        },
    };
    let begun = change(&mut client, set(70.0, 400.0));
    let tick = begun.tick.expect("it was begun");
    assert_eq!(begun.ramp_ends_tick, Some(tick + 400));
    wait_for(&mut client, "half of the ramp", |status| status.tick >= tick + 200);
    let turned = change(&mut client, set(35.0, 200.0)).tick.expect("it was begun");
    let mut rows: Vec<Sample> = Vec::new();
    while rows.last().is_none_or(|row| row.tick < turned + 300) {
        if let Event::Samples(batch) = listener.next_event().expect("the daemon goes on") {
            assert_eq!(batch.dropped, 0);
            rows.extend(batch.rows.iter().filter(|row| row.tick >= tick));
        }
    }
    // A ramp goes by the clock and not by ticks, but a stall counts for five periods at most.
    let step_s = |pair: &[Sample]| (pair[1].t_s - pair[0].t_s).min(0.005);
    let time_s = |tick| {
        let before = rows.windows(2).take_while(|pair| pair[1].tick <= tick);
        before.map(step_s).sum::<f64>()
    };
    let (begun_s, turned_s) = (time_s(tick), time_s(turned));
    let going_up = |t_s: f64| 35.0 + 35.0 * ((t_s - begun_s) / 0.4).min(1.0);
    let peak = going_up(turned_s);
    // Each step of force on the way is let in over this time, beginning again with the next one, s:
    // so far behind is the force.
    const LET_IN_S: f64 = 0.05;
    let (mut last, mut behind, mut left_s, mut now_s) = (35.0, 0.0, 0.0, 0.0);
    for pair in rows.windows(2) {
        let row = pair[1];
        now_s += step_s(pair);
        let set = if row.tick < turned {
            going_up(now_s)
        } else {
            peak + (35.0 - peak) * ((now_s - turned_s) / 0.2).min(1.0)
        };
        if set != last {
            (behind, left_s) = (behind * left_s / LET_IN_S + set - last, LET_IN_S);
            last = set;
        }
        left_s = (left_s - (row.t_s - pair[0].t_s)).max(0.0);
        let expected = set - behind * left_s / LET_IN_S;
        let drag = -row.command_force_n / row.device_velocity_mps;
        // A jump would be of 35 N s/m; what a stall counts for is known to a period.
        assert!(
            (drag - expected).abs() < 2.0,
            "tick {}: {drag} N s/m, not {expected} N s/m",
            row.tick
        );
    }
}

#[test]
fn whoever_listens_to_the_log_hears_every_change_and_the_stops() {
    let daemon = Daemon::start(&[]);
    let (mut client, mut listener) = (daemon.client(), daemon.client());
    let subscribe = Request::Subscribe {
        topics: vec![Topic::Log],
        rate_hz: None,
        batch_ms: None,
    };
    let _: SubscribeReply = listener.request(subscribe).expect("a subscription");
    change(&mut client, Request::set(params(&[("M", 1.0)])));
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    let stopped: StateReply = client.request(Request::Stop {}).expect("always");
    let _: StateReply = client.request(Request::Reset {}).expect("it is stopped");
    let mut heard = Vec::new();
    while heard.len() < 4 {
        if let Event::Log(entry) = listener.next_event().expect("the daemon goes on") {
            heard.push(*entry);
        }
    }
    let ops: Vec<&str> = heard.iter().map(|entry| entry.op.as_str()).collect();
    assert_eq!(ops, ["set", "engage", "stop", "reset"]);
    assert_eq!(heard[2].tick, Some(stopped.tick));
    assert_eq!(heard, log(&mut client));
}

#[test]
fn stops_of_stopped_rig_push_nothing_out_of_journal() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    change(&mut client, Request::set(params(&[("M", 1.0)])));
    let mut raw = daemon.raw();
    for _ in 0..30 {
        let burst: String = (0..100)
            .map(|id| format!("{{\"id\":{id},\"op\":\"stop\"}}\n"))
            .collect();
        raw.send(burst);
        for _ in 0..100 {
            assert_eq!(raw.line()["ok"]["state"], "stopped");
        }
    }
    let ops: Vec<String> = log(&mut client).into_iter().map(|entry| entry.op).collect();
    assert_eq!(ops, ["set", "stop"]);
}
