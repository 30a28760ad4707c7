//! The connection against a small daemon made of a socket and ready answers.

use haptic_core::Scene;
use haptic_gui::connection::{Connection, Patience};
use haptic_gui::{Answer, Intent, RecordingNews, Update};
use haptic_ipc::{
    AdviceReply, Envelope, ErrorCode, Event, Request, RigState, SceneReply, StateEvent, Topic, WireError, params_of,
};
use haptic_lab::recording::Metadata;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Long enough for a loaded machine; only a failing test waits for it.
const LIMIT: Duration = Duration::from_secs(20);

/// The daemon's end of one conversation.
struct Daemon {
    lines: BufReader<UnixStream>,
}

impl Daemon {
    /// Takes the next client and greets it.
    fn accept(listener: &UnixListener) -> Self {
        let (stream, _) = listener.accept().expect("a client");
        stream.set_read_timeout(Some(LIMIT)).expect("a time-out");
        let mut daemon = Self {
            lines: BufReader::new(stream),
        };
        daemon.say(r#"{"hello":{"protocol":1,"server":"hapticd test","session":"1-1"}}"#);
        daemon
    }

    fn say(&mut self, line: &str) {
        writeln!(self.lines.get_mut(), "{line}").expect("the client listens");
    }

    /// The next request, but for those for the scene, which are answered here.
    fn hear(&mut self) -> Envelope {
        loop {
            let mut line = String::new();
            self.lines.read_line(&mut line).expect("a request in time");
            let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line:?}: {error:?}"));
            if envelope.request != Request::get() {
                return envelope;
            }
            self.answer(envelope.id, &scene_reply());
        }
    }

    /// Answers a request whose kind the test knows.
    fn answer(&mut self, id: u64, ok: &str) {
        self.say(&format!(r#"{{"id":{id},"ok":{ok}}}"#));
    }

    fn report(&mut self, state: &StateEvent) {
        self.say(&serde_json::to_string(&Event::State(state.clone())).expect("an event"));
    }

    /// Takes a request for advice.
    fn hear_advise(&mut self) -> u64 {
        let advise = self.hear();
        assert_eq!(advise.request, Request::Advise {});
        advise.id
    }

    /// Goes through what every panel asks first.
    fn introduce(&mut self) {
        let describe = self.hear();
        assert_eq!(describe.request, Request::Describe {});
        self.answer(describe.id, r#"{"parameters":[],"sample_columns":[]}"#);
        let subscribe = self.hear();
        let Request::Subscribe { topics, .. } = subscribe.request else {
            panic!("{subscribe:?}");
        };
        assert_eq!(topics, [Topic::State, Topic::Timing, Topic::Samples, Topic::Log]);
        let reply = r#"{"topics":["state"],"rate_hz":250,"batch_ms":33,"columns":[]}"#;
        self.answer(subscribe.id, reply);
        let library = self.hear();
        assert_eq!(library.request, Request::SceneList {});
        self.answer(library.id, r#"{"scenes":[]}"#);
        let log = self.hear();
        assert!(matches!(log.request, Request::Log { .. }), "{log:?}");
        self.answer(log.id, r#"{"entries":[],"oldest_kept":1}"#);
    }
}

fn scene_reply() -> String {
    let scene = Scene::paper();
    let reply = SceneReply {
        revision: 1,
        params: params_of(&scene),
        scene,
    };
    serde_json::to_string(&reply).expect("a reply")
}

struct Bench {
    dir: tempfile::TempDir,
    connection: Connection,
}

impl Bench {
    fn new() -> Self {
        Self::with_patience(Patience {
            retry: Duration::from_millis(5),
            silence: LIMIT,
        })
    }

    fn with_patience(patience: Patience) -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        let path = socket(dir.path());
        let connection = Connection::start(move || path.clone(), patience, |_| {}).expect("threads");
        Self { dir, connection }
    }

    fn listen(&self) -> UnixListener {
        UnixListener::bind(socket(self.dir.path())).expect("a socket")
    }

    /// Ends the daemon as a process that dies does: nothing is left but the socket's file, and then not even that.
    fn end(&self, listener: UnixListener) {
        drop(listener);
        std::fs::remove_file(socket(self.dir.path())).expect("the socket is there");
    }

    /// Waits for news of one kind and gives what `pick` makes of it.
    fn until<T>(&self, pick: impl Fn(Update) -> Option<T>) -> T {
        loop {
            let update = self.connection.wait(LIMIT).expect("news in time");
            if let Some(found) = pick(update) {
                return found;
            }
        }
    }

    fn until_connected(&self) {
        self.until(|update| {
            matches!(update, Update::Connected { hello, .. } if hello.server == "hapticd test").then_some(())
        });
    }

    fn until_lost(&self) -> String {
        self.until(|update| match update {
            Update::Disconnected { reason, .. } => Some(reason),
            _ => None,
        })
    }
}

fn of_revision(revision: u64) -> StateEvent {
    StateEvent {
        law: "karnopp".to_owned(),
        undo_depth: 0,
        redo_depth: 0,
        state: RigState::Idle,
        fault: None,
        tick: 5,
        revision,
        scene: "paper".into(),
        params: params_of(&Scene::paper()),
    }
}

fn advised(update: Update) -> Option<Result<AdviceReply, WireError>> {
    match update {
        Update::Advised(result) => Some(result),
        _ => None,
    }
}

fn socket(dir: &Path) -> PathBuf {
    dir.join("control.sock")
}

#[test]
fn it_waits_for_a_daemon_and_finds_the_next_one_when_that_goes_away() {
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
    let heard = bench.until(|update| match update {
        Update::Event(Event::State(event)) => Some(event),
        _ => None,
    });
    assert_eq!(heard, state);
}

#[test]
fn an_intent_is_sent_and_its_answer_comes_back_with_it() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Release);
    let engage = daemon.hear();
    let release = daemon.hear();
    assert_eq!(
        (&engage.request, &release.request),
        (&Request::Engage {}, &Request::Release {})
    );
    daemon.answer(engage.id, r#"{"state":"engaging","tick":7}"#);
    let refusal = r#""error":{"code":"wrong_state","message":"not now"}"#;
    daemon.say(&format!(r#"{{"id":{},{refusal}}}"#, release.id));
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
fn a_stop_without_a_daemon_does_not_wait_and_is_the_first_thing_that_the_next_one_hears() {
    let never = Duration::from_secs(3600);
    let bench = Bench::with_patience(Patience {
        retry: never,
        silence: LIMIT,
    });
    bench.until_lost();
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Stop);
    // Only the stop can have caused this attempt.
    bench.until_lost();
    let listener = bench.listen();
    bench.connection.send(Intent::Stop);
    let mut daemon = Daemon::accept(&listener);
    assert_eq!(daemon.hear().request, Request::Stop {});
    daemon.introduce();
}

#[test]
fn a_stop_that_was_not_answered_is_sent_again() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    bench.connection.send(Intent::Stop);
    assert_eq!(daemon.hear().request, Request::Stop {});
    drop(daemon);
    let mut daemon = Daemon::accept(&listener);
    let stop = daemon.hear();
    assert_eq!(stop.request, Request::Stop {});
    daemon.answer(stop.id, r#"{"state":"stopped","tick":9}"#);
    daemon.introduce();
    bench.until(|update| match update {
        Update::Answered {
            intent: Intent::Stop,
            result,
        } => Some(result.unwrap()),
        _ => None,
    });
}

#[test]
fn a_line_that_cannot_be_read_is_counted_and_the_conversation_goes_on() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    daemon.say(r#"{"event":"samples","seq":"first"}"#);
    bench.until(|update| matches!(update, Update::Unreadable { .. }).then_some(()));
    bench.connection.send(Intent::Engage);
    assert_eq!(daemon.hear().request, Request::Engage {});
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
    assert!(reason.contains("said nothing"), "{reason}");
}

#[test]
fn the_adviser_is_asked_about_every_new_scene_but_not_while_it_has_yet_to_answer() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
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
    // The scene is the same, so what is heard next is the user.
    daemon.report(&of_revision(3));
    bench.connection.send(Intent::Engage);
    assert_eq!(daemon.hear().request, Request::Engage {});
}

#[test]
fn a_daemon_without_an_adviser_is_asked_once() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    daemon.report(&of_revision(1));
    let advise = daemon.hear_advise();
    let refusal = r#""error":{"code":"unknown_op","message":"there is no operation `advise`"}"#;
    daemon.say(&format!(r#"{{"id":{advise},{refusal}}}"#));
    assert_eq!(bench.until(advised).unwrap_err().code, ErrorCode::UnknownOp);
    daemon.report(&of_revision(2));
    bench.until(|update| matches!(update, Update::Event(Event::State(state)) if state.revision == 2).then_some(()));
    bench.connection.send(Intent::Engage);
    assert_eq!(daemon.hear().request, Request::Engage {});
}

#[test]
fn advice_that_cannot_be_read_does_not_end_the_conversation() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    daemon.report(&of_revision(1));
    let advise = daemon.hear_advise();
    daemon.answer(advise, r#"{"advice":"later"}"#);
    let error = bench.until(advised).unwrap_err();
    assert!(error.message.contains("cannot be read"), "{error}");
    daemon.report(&of_revision(2));
    daemon.hear_advise();
}

#[test]
fn another_law_has_other_parameters_which_are_asked_for() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
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

#[test]
fn a_recording_holds_what_was_heard_and_ends_with_the_connection() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    let metadata = Metadata {
        server: "hapticd test".into(),
        device: "fake rig".into(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: Scene::paper(),
    };
    bench.connection.send(Intent::Record {
        folder: bench.dir.path().to_path_buf(),
        metadata: Box::new(metadata),
    });
    // An intent that is answered has overtaken none before it.
    bench.connection.send(Intent::Engage);
    daemon.hear();
    let row = r#"[7,0.007,"engaged",0,0.1,0,0.1,0,3.25,-3.25,1,0,0,0]"#;
    daemon.say(&format!(r#"{{"event":"samples","seq":0,"dropped":2,"rows":[{row}]}}"#));
    let going = bench.until(|update| match update {
        Update::Recording(RecordingNews::Going { totals, .. }) if totals.rows > 0 => Some(totals),
        _ => None,
    });
    assert_eq!((going.rows, going.lost), (1, 2));
    drop(daemon);
    let path = bench.until(|update| match update {
        Update::Recording(RecordingNews::Ended { path, .. }) => Some(path),
        _ => None,
    });
    let recording = haptic_lab::recording::read(&path).unwrap();
    assert_eq!(recording.rows[0].coupling_force_n, 3.25);
    assert!(recording.metadata.started_unix_s > 1e9, "by the clock");
}
