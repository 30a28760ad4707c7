//! The control plane of a running daemon, beside what the transcripts of whole conversations show.

use haptic_ipc::{ChangeReply, Changes, Client, MAX_LINE_BYTES, Request};
use serde_json::Value;
use system_tests::{Daemon, journal, wait_for};

fn set(changes: &[(&str, f64)]) -> Request {
    Request::set(changes.iter().copied().collect::<Changes>())
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
    let request = r#"{"id":1,"op":"get"}"#;
    let fits = format!("{request}{}", " ".repeat(MAX_LINE_BYTES - request.len()));
    assert_eq!(raw.ask(&fits)["id"], 1);
    for longer in [format!("{fits} "), " ".repeat(10 * MAX_LINE_BYTES)] {
        let answer = raw.ask(&longer);
        assert_eq!(
            (&answer["id"], &answer["error"]["code"]),
            (&Value::Null, &"line_too_long".into())
        );
    }
    // Bytes that are not text are refused like any other line that is not JSON.
    raw.send(b"\xff\xfe\n");
    assert_eq!(raw.line()["error"]["code"], "bad_json");
    assert_eq!(raw.ask(request)["id"], 1);
}

#[test]
fn journal_names_who_changed_and_took_back_what() {
    let daemon = Daemon::start(&[]);
    let (mut ada, mut bob) = (daemon.client(), daemon.client());
    let first = change(&mut ada, set(&[("M", 1.5), ("Fs+", 5.0)]));
    change(&mut bob, set(&[("M", 2.0)]));
    let undone = change(&mut ada, Request::undo());
    assert_eq!(undone.revision, 4, "a step back is a change too");
    change(&mut bob, Request::redo());

    let entries = journal(&mut ada);
    let by: Vec<_> = entries.iter().filter_map(|entry| entry.by.as_ref()).collect();
    let sessions: Vec<&str> = by.iter().map(|by| by.session.as_str()).collect();
    assert_eq!(ops(&mut ada), ["set", "set", "undo", "redo"]);
    let (ada, bob) = (ada.hello().session.as_str(), bob.hello().session.as_str());
    assert_ne!(ada, bob);
    assert_eq!(sessions, [ada, bob, ada, bob]);
    assert!(by.iter().all(|by| by.uid == rustix::process::geteuid().as_raw()));
    assert_eq!(entries[0].tick, first.tick);
    let written: Vec<String> = entries[0].changes.iter().map(ToString::to_string).collect();
    assert_eq!(written, ["mass: 0.5 kg -> 1.5 kg", "static_force: 4 N -> +5 -4 N"]);
    assert!(entries.windows(2).all(|pair| pair[0].seq + 1 == pair[1].seq));
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
