//! The connection against a small daemon.

mod daemon;
#[path = "../fixture/metadata.rs"]
mod metadata;
#[path = "../fixture/state.rs"]
mod state;
mod stop;

use daemon::{Bench, Daemon, advised, introduced, of_revision};
use haptic_core::Scene;
use haptic_ipc::{ANYWAY, ErrorCode, Event, Request, WireError, params_of};
use haptic_panel::connection::Patience;
use haptic_panel::{Answer, Intent, RecordingNews, Update};
use haptic_recording::{Ending, Format, Totals};
use metadata::metadata;
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::time::Duration;

#[test]
fn connection_waits_for_a_daemon_and_finds_the_next_one() {
    let bench = Bench::new();
    let reason = bench.until_lost();
    assert!(reason.contains("control.sock"), "{reason}");

    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    bench.until(|update| matches!(update, Update::Described(_)).then_some(()));

    bench.end(listener);
    drop(daemon);
    bench.until_lost();

    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    let state = of_revision(1);
    daemon.report(&state);
    let received = bench.until(|update| match update {
        Update::Event(Event::State(event)) => Some(event),
        _ => None,
    });
    assert_eq!(received, state);
}

#[test]
fn panel_turns_to_the_rig_that_is_chosen() {
    let bench = Bench::new();
    bench.until_lost();
    let other = bench.dir.path().join("other.sock");
    let listener = UnixListener::bind(&other).expect("a socket");
    bench.connection.send(Intent::ConnectTo { path: other.clone() });
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until(|update| matches!(update, Update::Connected { path, .. } if path == other).then_some(()));
}

#[test]
fn an_intent_is_sent_and_its_answer_comes_back_with_it() {
    let (bench, _listener, mut daemon) = introduced();
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Release);
    let engage = daemon.hear();
    let release = daemon.hear();
    assert_eq!(
        (&engage.request, &release.request),
        (&Request::engage(), &Request::Release {})
    );
    daemon.answer(engage.id, r#"{"state":"engaging","tick":7}"#);
    daemon.refuse(release.id, &WireError::new(ErrorCode::WrongState, "not now"));
    let answered = |update| match update {
        Update::Answered { intent, result } => Some((intent, result)),
        _ => None,
    };
    let (intent, result) = bench.until(answered);
    assert_eq!(intent, Intent::Engage);
    assert!(matches!(result, Ok(Answer::State(reply)) if reply.tick == 7));
    let (intent, result) = bench.until(answered);
    assert_eq!(intent, Intent::Release);
    assert_eq!(result.unwrap_err().message, "not now");
}

#[test]
fn a_refusal_names_the_buttons_of_the_panel() {
    let (bench, _listener, mut daemon) = introduced();
    let scene = Box::new(Scene::paper());
    for (intent, end) in [
        (Intent::Engage, "; the button Anyway does it all the same"),
        (
            Intent::Undo,
            "; the button Change anyway, below the parameters, does it all the same",
        ),
        (Intent::Foresee { scene }, ""),
    ] {
        bench.connection.send(intent);
        let asked = daemon.hear();
        let message = format!("it would chatter; K = 410 N/m would pass{ANYWAY}");
        daemon.refuse(asked.id, &WireError::new(ErrorCode::WouldChatter, message));
        let refused = bench.until(|update| match update {
            Update::Answered { result, .. } => result.err(),
            _ => None,
        });
        assert_eq!(
            refused.message,
            format!("it would chatter; K = 410 N/m would pass{end}")
        );
    }
}

#[test]
fn a_daemon_that_falls_silent_is_given_up() {
    let bench = Bench::with_patience(Patience {
        retry: Duration::from_millis(5),
        silence: Duration::from_millis(50),
    });
    let listener = bench.listen();
    let _daemon = Daemon::accept(&listener);
    bench.until_connected();
    let reason = bench.until_lost();
    assert!(reason.contains("sent nothing"), "{reason}");
}

// hazard: H28
#[test]
fn a_daemon_that_sends_no_sample_is_reported_until_it_does() {
    let (bench, _listener, mut daemon) = introduced();
    let no_sample = |update| match update {
        Update::NoSample(lasts) => Some(lasts),
        Update::Disconnected { reason, .. } if reason.contains("sent nothing") => panic!("{reason}"),
        _ => None,
    };
    let long = Duration::from_millis(300);
    for _ in 0..2 {
        // Whatever else it says.
        daemon.report(&of_revision(1));
        let first = bench.until(no_sample);
        assert!(first >= long && bench.until(no_sample) > first);
        daemon.say(r#"{"event":"samples","seq":0,"dropped":0,"rows":[]}"#);
        bench.until(|update| no_sample(update).filter(Duration::is_zero));
    }
}

#[test]
fn adviser_is_asked_about_new_scenes_one_request_at_a_time() {
    let (bench, _listener, mut daemon) = introduced();
    daemon.report(&of_revision(1));
    let first = daemon.hear_advise();
    for revision in [2, 3, 3] {
        daemon.report(&of_revision(revision));
    }
    daemon.answer(first, r#"{"revision":1,"advice":[]}"#);
    assert_eq!(bench.until(advised).unwrap().revision, 1);
    let second = daemon.hear_advise();
    let finding = r#"{"check":"friction","passes":false,"value":null,"bound":1,"unit":"N","margin":0.5,"mending":2}"#;
    let advice = format!(r#"{{"param":"stiffness","message":"too stiff","finding":{finding}}}"#);
    daemon.answer(second, &format!(r#"{{"revision":3,"advice":[{advice}]}}"#));
    let reply = bench.until(advised).unwrap();
    assert_eq!((reply.revision, reply.advice[0].param.as_str()), (3, "stiffness"));
    // The scene is the same, so the next request is the user's.
    daemon.report(&of_revision(3));
    bench.connection.send(Intent::Engage);
    assert_eq!(daemon.hear().request, Request::engage());
}

#[test]
fn lines_that_cannot_be_read_do_not_end_the_conversation() {
    let (bench, _listener, mut daemon) = introduced();
    daemon.say(r#"{"event":"samples","seq":"first"}"#);
    bench.until(|update| matches!(update, Update::Unreadable { .. }).then_some(()));
    daemon.report(&of_revision(1));
    let advise = daemon.hear_advise();
    daemon.answer(advise, r#"{"advice":"later"}"#);
    let error = bench.until(advised).unwrap_err();
    assert!(error.message.contains("cannot be read"), "{error}");
    daemon.report(&of_revision(2));
    // A daemon without an adviser is asked no more.
    let advise = daemon.hear_advise();
    daemon.refuse(
        advise,
        &WireError::new(ErrorCode::UnknownOp, "unknown operation `advise`"),
    );
    assert_eq!(bench.until(advised).unwrap_err().code, ErrorCode::UnknownOp);
    daemon.report(&of_revision(3));
    bench.until(|update| matches!(update, Update::Event(Event::State(state)) if state.revision == 3).then_some(()));
    bench.connection.send(Intent::Engage);
    assert_eq!(daemon.hear().request, Request::engage());
}

#[test]
fn another_law_has_other_parameters_which_are_asked_for() {
    let (bench, _listener, mut daemon) = introduced();
    let described = |update| matches!(update, Update::Described(_)).then_some(());
    bench.until(described);
    daemon.report(&of_revision(1));
    let advise = daemon.hear_advise();
    daemon.answer(advise, r#"{"revision":1,"advice":[]}"#);
    let dahl = Scene::paper().with_law("dahl").unwrap().unwrap();
    let mut event = of_revision(2);
    (event.law, event.params) = ("dahl".to_owned(), params_of(&dahl));
    daemon.report(&event);
    let describe = daemon.hear();
    assert_eq!(describe.request, Request::Describe {});
    daemon.answer(describe.id, r#"{"law":"dahl","parameters":[],"sample_columns":[]}"#);
    bench.until(described);
}

/// A recording of one sample that is still written, with its file and what it holds.
fn recording(format: Format) -> (Bench, Daemon, PathBuf, Totals) {
    let (bench, _, mut daemon) = introduced();
    bench.connection.send(Intent::Record {
        format,
        folder: bench.dir.path().to_path_buf(),
        metadata: Box::new(metadata()),
    });
    // It subscribes anew, and begins with the snapshot that comes of it.
    let subscribe = daemon.hear();
    assert!(matches!(subscribe.request, Request::Subscribe { .. }), "{subscribe:?}");
    let earlier = r#"[6,0.006,"engaged",0,0.1,0,0.1,0,3.25,-3.25,1,0,0,0]"#;
    daemon.say(&format!(
        r#"{{"event":"samples","seq":9,"dropped":0,"rows":[{earlier}]}}"#
    ));
    let scene = serde_json::to_string(&Scene::paper()).expect("a scene");
    let snapshot = format!(r#"{{"version":1,"scene":{{"revision":1,"scene":{scene}}},"fields":{{}}}}"#);
    daemon.say(&format!(r#"{{"event":"snapshot","tick":7,"snapshot":{snapshot}}}"#));
    let row = r#"[7,0.007,"engaged",0,0.1,0,0.1,0,3.25,-3.25,1,0,0,0]"#;
    daemon.say(&format!(r#"{{"event":"samples","seq":0,"dropped":2,"rows":[{row}]}}"#));
    let (path, totals) = bench.until(|update| match update {
        Update::Recording(RecordingNews::Going { path, totals }) if totals.rows > 0 => Some((path, totals)),
        _ => None,
    });
    (bench, daemon, path, totals)
}

#[test]
fn a_recording_has_its_end_mark_when_the_window_is_closed() {
    for format in [Format::Mcap, Format::Csv, Format::Parquet] {
        let (bench, _daemon, path, _) = recording(format);
        let before = haptic_recording::read(&path).map(|found| found.ending);
        assert_ne!(before.ok(), Some(Ending::Complete), "{format:?} is still written");
        let Bench { dir, connection } = bench;
        drop(connection);
        let found = haptic_recording::read(&path).expect("a recording");
        assert_eq!((found.ending, found.rows.len()), (Ending::Complete, 1), "{format:?}");
        drop(dir);
    }
}

#[test]
fn recording_holds_received_rows_and_ends_with_connection() {
    let (bench, daemon, _, going) = recording(Format::Csv);
    assert_eq!((going.rows, going.lost), (1, 2));
    drop(daemon);
    let path = bench.until(|update| match update {
        Update::Recording(RecordingNews::Ended { path, .. }) => Some(path),
        _ => None,
    });
    let recording = haptic_recording::read(&path).unwrap();
    assert_eq!(recording.rows[0].coupling_force_n, 3.25);
    assert!(recording.metadata.started_unix_s > 1e9, "by the clock");
}
