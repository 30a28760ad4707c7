//! The connection against a small daemon made of a socket and ready answers.

#[path = "fixture/metadata.rs"]
mod metadata;

use haptic_core::Scene;
use haptic_gui::connection::{Connection, Patience};
use haptic_gui::{Answer, Intent, RecordingNews, StopNews, Update};
use haptic_ipc::{
    AdviceReply, Envelope, ErrorCode, Event, Request, RigState, SceneReply, StateEvent, Topic, WireError, params_of,
};
use metadata::metadata;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Long enough for a loaded machine; only a failing test waits for it.
const LIMIT: Duration = Duration::from_secs(20);

/// The daemon's end of one conversation.
struct Daemon {
    lines: BufReader<UnixStream>,
    /// What was read of it to see that it is the conversation.
    heard: VecDeque<String>,
    /// Connections that are ready for a stop.
    _for_stops: Vec<UnixStream>,
}

/// Takes the next client and greets it.
fn greet(listener: &UnixListener) -> UnixStream {
    let (mut stream, _) = listener.accept().expect("a client");
    stream.set_read_timeout(Some(LIMIT)).expect("a time-out");
    writeln!(
        stream,
        r#"{{"hello":{{"protocol":1,"server":"hapticd test","session":"1-1"}}}}"#
    )
    .unwrap_or(());
    stream
}

fn is_stop(line: &str) -> bool {
    Envelope::parse(line).is_ok_and(|envelope| envelope.request == Request::Stop {})
}

impl Daemon {
    /// Takes the panel's next conversation. A connection on which there is nothing but stops is the panel's other one, and is kept waiting.
    fn accept(listener: &UnixListener) -> Self {
        let mut for_stops: Vec<(BufReader<UnixStream>, VecDeque<String>)> = Vec::new();
        listener.set_nonblocking(true).expect("it can be");
        let began = Instant::now();
        loop {
            assert!(began.elapsed() < LIMIT, "no conversation in time");
            if let Ok((mut stream, _)) = listener.accept() {
                stream.set_nonblocking(false).expect("it can be");
                writeln!(
                    stream,
                    r#"{{"hello":{{"protocol":1,"server":"hapticd test","session":"1-1"}}}}"#
                )
                .unwrap_or(());
                stream
                    .set_read_timeout(Some(Duration::from_millis(5)))
                    .expect("a time-out");
                for_stops.push((BufReader::new(stream), VecDeque::new()));
            }
            for place in 0..for_stops.len() {
                let (lines, heard) = &mut for_stops[place];
                let mut line = String::new();
                if lines.read_line(&mut line).is_ok_and(|read| read > 0) {
                    heard.push_back(line);
                }
                if heard.iter().any(|line| !is_stop(line)) {
                    let (lines, heard) = for_stops.swap_remove(place);
                    lines.get_ref().set_read_timeout(Some(LIMIT)).expect("a time-out");
                    listener.set_nonblocking(false).expect("it can be");
                    return Self {
                        lines,
                        heard,
                        _for_stops: for_stops.into_iter().map(|(lines, _)| lines.into_inner()).collect(),
                    };
                }
            }
        }
    }

    fn say(&mut self, line: &str) {
        writeln!(self.lines.get_mut(), "{line}").expect("the client listens");
    }

    /// The next request, but for those for the scene, which are answered here.
    fn hear(&mut self) -> Envelope {
        loop {
            let line = self.heard.pop_front().unwrap_or_else(|| {
                let mut line = String::new();
                self.lines.read_line(&mut line).expect("a request in time");
                line
            });
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
    let metadata = metadata();
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

/// The panel's connection for stops, which comes after its conversation.
struct StopLine(BufReader<UnixStream>);

impl StopLine {
    fn accept(listener: &UnixListener) -> Self {
        Self(BufReader::new(greet(listener)))
    }

    /// The number of the next stop.
    fn hear(&mut self) -> u64 {
        let mut line = String::new();
        self.0.read_line(&mut line).expect("a stop in time");
        let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line:?}: {error:?}"));
        assert_eq!(envelope.request, Request::Stop {});
        envelope.id
    }

    fn confirm(&mut self, id: u64) {
        writeln!(self.0.get_mut(), r#"{{"id":{id},"ok":{{"state":"stopped","tick":9}}}}"#).expect("the panel listens");
    }
}

impl Bench {
    fn until_stop_news(&self) -> StopNews {
        self.until(|update| match update {
            Update::Stop(news) => Some(news),
            _ => None,
        })
    }
}

/// A daemon on the panel's two connections.
fn connected(bench: &Bench) -> (UnixListener, Daemon, StopLine) {
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    let stops = StopLine::accept(&listener);
    (listener, daemon, stops)
}

// hazard: H4
#[test]
fn a_stop_goes_out_on_a_connection_of_its_own_and_its_time_is_told() {
    let bench = Bench::new();
    let (_listener, mut daemon, mut stops) = connected(&bench);
    for number in 1..=3 {
        bench.connection.send(Intent::Stop);
        assert_eq!(stops.hear(), number);
        assert_eq!(bench.until_stop_news(), StopNews::Sent);
        stops.confirm(number);
        let StopNews::Answered { after, result } = bench.until_stop_news() else {
            panic!("it was answered");
        };
        assert!(result.is_ok_and(|reply| reply.tick == 9) && after < LIMIT);
        // And behind what was written before it.
        assert_eq!(daemon.hear().request, Request::Stop {});
    }
}

// hazard: H4
#[test]
fn a_stop_that_a_full_socket_does_not_take_is_not_sent_until_it_does() {
    let bench = Bench::new();
    let (_listener, _daemon, mut stops) = connected(&bench);
    // This daemon reads nothing.
    let mut pressed = 0;
    let reason = loop {
        assert!(pressed < 100_000, "a socket has an end");
        bench.connection.stop();
        pressed += 1;
        match bench.until_stop_news() {
            StopNews::Sent => {}
            StopNews::NotSent { reason } => break reason,
            news @ StopNews::Answered { .. } => panic!("{news:?}"),
        }
    };
    assert_eq!(reason, "the daemon does not read");
    while stops.hear() < pressed {}
    assert_eq!(bench.until_stop_news(), StopNews::Sent);
}

// hazard: H4
#[test]
fn a_stop_without_a_daemon_is_told_as_not_sent() {
    let bench = Bench::new();
    bench.until_lost();
    bench.connection.stop();
    let news = bench.until_stop_news();
    assert!(
        matches!(&news, StopNews::NotSent { reason } if reason == "no connection"),
        "{news:?}"
    );
}

// hazard: H4
#[test]
fn a_stop_whose_daemon_dies_before_it_answers_is_told_as_not_sent_and_sent_to_the_next() {
    let bench = Bench::new();
    let (listener, daemon, mut stops) = connected(&bench);
    bench.connection.stop();
    stops.hear();
    assert_eq!(bench.until_stop_news(), StopNews::Sent);
    bench.end(listener);
    drop((daemon, stops));
    assert!(matches!(bench.until_stop_news(), StopNews::NotSent { .. }));
    let listener = bench.listen();
    // Whichever of the two connections comes first.
    let mut line = BufReader::new(greet(&listener));
    let mut text = String::new();
    line.read_line(&mut text).expect("a stop in time");
    assert!(is_stop(&text), "{text}");
}

// hazard: H4
#[test]
fn what_was_asked_before_a_stop_does_not_bring_the_force_back_after_it() {
    let bench = Bench::new();
    let (_listener, mut daemon, mut stops) = connected(&bench);
    // The daemon reads nothing of the conversation, until its socket is full and the rest waits in the panel.
    let target = haptic_gui::Target {
        name: "mass".into(),
        direction: None,
    };
    for _ in 0..20_000 {
        let (target, value, merge) = (target.clone(), 0.5, false);
        bench.connection.send(Intent::Set { target, value, merge });
    }
    bench.connection.send(Intent::Reset);
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Stop);
    stops.hear();
    bench.connection.send(Intent::Undo);
    // Behind what was in the socket already comes the stop, ahead of all that waited; what would bring the force back is dropped.
    let mut was_stopped = false;
    loop {
        match daemon.hear().request {
            Request::Stop {} => was_stopped = true,
            Request::Reset {} | Request::Engage {} => panic!("after a stop"),
            Request::Undo { .. } => break,
            _ => {}
        }
    }
    assert!(was_stopped);
}

// hazard: H4
#[test]
fn a_house_that_is_full_is_left_to_others_until_there_is_a_stop() {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    let for_a_moment = |listener: &UnixListener| {
        let (mut stream, _) = listener.accept().expect("a client");
        stream.set_read_timeout(Some(LIMIT)).expect("a time-out");
        let hello = r#"{"hello":{"protocol":1,"server":"hapticd test","session":"1-9","rights":"stop"}}"#;
        writeln!(stream, "{hello}").expect("it listens");
        stream
    };
    let mut idle = String::new();
    let read = BufReader::new(for_a_moment(&listener)).read_line(&mut idle);
    assert_eq!(read.expect("it hangs up"), 0, "{idle}");
    bench.connection.stop();
    let mut stops = StopLine(BufReader::new(for_a_moment(&listener)));
    let number = stops.hear();
    stops.confirm(number);
    bench.until(|update| matches!(update, Update::Stop(StopNews::Answered { .. })).then_some(()));
}
