//! The control plane of a running daemon, beside what the transcripts of whole conversations show.

use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Client, ErrorCode, MAX_LINE_BYTES, Request, RigState, SceneReply,
};
use serde_json::Value;
use system_tests::{Daemon, engage, journal, refused, status, wait_for};

fn set(changes: &[(&str, f64)]) -> Request {
    Request::set(changes.iter().copied().collect::<Changes>())
}

fn mass(client: &mut Client) -> f64 {
    let reply: SceneReply = client.request(Request::get()).expect("the scene");
    reply.params["mass"].positive
}

fn change(client: &mut Client, request: Request) -> ChangeReply {
    client.request(request).expect("it is accepted")
}

fn ops(client: &mut Client) -> Vec<String> {
    journal(client).into_iter().map(|entry| entry.op).collect()
}

#[test]
fn line_of_exactly_the_limit_is_served_and_no_longer_one() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let padding = |length: usize| " ".repeat(length);
    let request = r#"{"id":1,"op":"get"}"#;
    let fits = format!("{request}{}", padding(MAX_LINE_BYTES - request.len()));
    assert_eq!(raw.ask(&fits)["id"], 1);
    let answer = raw.ask(&format!("{fits} "));
    assert_eq!(
        (&answer["id"], &answer["error"]["code"]),
        (&Value::Null, &"line_too_long".into())
    );
    assert_eq!(raw.ask(&padding(10 * MAX_LINE_BYTES))["error"]["code"], "line_too_long");
    // Bytes that are not text are refused like any other line that is not JSON.
    raw.send(b"\xff\xfe\n");
    assert_eq!(raw.line()["error"]["code"], "bad_json");
    assert_eq!(raw.ask(r#"{"id":4,"op":"get"}"#)["id"], 4);
}

#[test]
fn a_reset_asked_before_a_stop_does_not_clear_it() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    for _ in 0..20 {
        let _ = raw.ask(r#"{"id":1,"op":"stop"}"#);
        raw.send("{\"id\":2,\"op\":\"reset\"}\n{\"id\":3,\"op\":\"engage\"}\n{\"id\":4,\"op\":\"stop\"}\n");
        let answers = [raw.line(), raw.line(), raw.line()];
        assert_eq!(answers[2]["ok"]["state"], "stopped", "{answers:?}");
        assert_eq!(status(&mut daemon.client()).state, RigState::Stopped, "{answers:?}");
    }
}

#[test]
fn journal_names_who_changed_and_took_back_what() {
    let daemon = Daemon::start(&[]);
    let (mut ada, mut bob) = (daemon.client(), daemon.client());
    let first = change(&mut ada, set(&[("M", 1.5), ("Fs+", 5.0)]));
    change(&mut bob, set(&[("M", 2.0)]));
    let undone = change(&mut ada, Request::undo());
    assert_eq!(
        (undone.revision, mass(&mut bob)),
        (4, 1.5),
        "a step back is a change too"
    );
    change(&mut ada, Request::undo());
    assert_eq!(refused(&mut ada, Request::undo()).code, ErrorCode::NothingToUndo);
    change(&mut bob, Request::redo());
    assert_eq!((status(&mut ada).undo_depth, status(&mut ada).redo_depth), (1, 1));

    let entries = journal(&mut ada);
    assert_eq!(ops(&mut ada), ["set", "set", "undo", "undo", "redo"]);
    let by: Vec<_> = entries.iter().filter_map(|entry| entry.by.as_ref()).collect();
    let sessions: Vec<&str> = by.iter().map(|by| by.session.as_str()).collect();
    let (ada, bob) = (ada.hello().session.as_str(), bob.hello().session.as_str());
    assert_eq!(sessions, [ada, bob, ada, ada, bob]);
    assert!(by.iter().all(|by| by.uid == rustix::process::geteuid().as_raw()));
    assert_eq!(entries[0].tick, first.tick);
    let written: Vec<String> = entries[0].changes.iter().map(ToString::to_string).collect();
    assert_eq!(written, ["mass: 0.5 kg -> 1.5 kg", "static_force: 4 N -> +5 -4 N"]);
    assert!(entries.windows(2).all(|pair| pair[0].seq + 1 == pair[1].seq));
}

#[test]
fn setting_the_current_value_is_a_no_op() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    change(&mut client, set(&[("M", 1.5)]));
    change(&mut client, set(&[("Fs", 5.0)]));
    change(&mut client, Request::undo());
    for nothing in [set(&[("M", 1.5)]), set(&[])] {
        let reply = change(&mut client, nothing);
        assert_eq!((reply.revision, reply.changes.len()), (4, 0));
        assert_eq!((reply.changed, reply.tick), (false, None), "no tick has rendered it");
    }
    assert_eq!(journal(&mut client).len(), 3);
    let redone = change(&mut client, Request::redo());
    assert_eq!((redone.revision, redone.applied["static_force"]), (5, 5.0));
    // A ramp that is still going is cut short by the same value at once. Without force there is none.
    engage(&mut client);
    let slowly = Request::Set {
        params: [("M", 3.0)].into_iter().collect(),
        merge: false,
        options: ChangeOptions {
            ramp_ms: Some(10_000.0),
            ..ChangeOptions::default()
        },
    };
    change(&mut client, slowly);
    assert_eq!(change(&mut client, set(&[("M", 3.0)])).revision, 7);
}

#[test]
fn thousand_pipelined_changes_are_answered_in_order() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let mut client = daemon.client();
    let mut last_tick = 0;
    for burst in 0..20 {
        let ids = 50 * burst..50 * (burst + 1);
        let line = |id: i32| {
            let mass = 1.0 + 0.01 * f64::from(id);
            format!("{{\"id\":{id},\"op\":\"set\",\"params\":{{\"M\":{mass}}}}}\n")
        };
        raw.send(ids.clone().map(line).collect::<String>());
        for id in ids {
            let answer = raw.line();
            assert_eq!(
                (&answer["id"], &answer["ok"]["revision"]),
                (&id.into(), &(id + 2).into())
            );
            let tick = answer["ok"]["tick"].as_u64().expect("it was rendered");
            assert!(tick >= last_tick);
            last_tick = tick;
        }
    }
    assert!((mass(&mut client) - 10.99).abs() < 1e-12);
    assert_eq!(journal(&mut client).len(), 1000);
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
    system_tests::until("they are not in the journal", || {
        let entries = journal(&mut watcher);
        entries.len() == 2 && entries.iter().all(|entry| entry.tick.is_some())
    });
}

#[test]
fn stops_of_stopped_rig_push_nothing_out_of_journal() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    change(&mut client, set(&[("M", 1.0)]));
    let mut raw = daemon.raw();
    for _ in 0..30 {
        raw.send("{\"id\":1,\"op\":\"stop\"}\n".repeat(100));
        for _ in 0..100 {
            assert_eq!(raw.line()["ok"]["state"], "stopped");
        }
    }
    assert_eq!(ops(&mut client), ["set", "stop"]);
}
