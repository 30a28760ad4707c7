//! A small daemon made of a socket and ready answers, and a connection to it.

use crate::state::state_event;
use haptic_core::Scene;
use haptic_ipc::{
    AdviceReply, Envelope, Event, Request, RigState, SceneReply, StateEvent, Topic, WireError, params_of,
};
use haptic_panel::connection::{Connection, Patience};
use haptic_panel::{StopNews, Update};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Long enough for a loaded machine; only a failing test waits for it.
pub(crate) const LIMIT: Duration = Duration::from_secs(20);

pub(crate) const HELLO: &str = r#"{"hello":{"protocol":1,"server":"hapticd test","session":"1-1"}}"#;

/// The daemon's end of one conversation.
pub(crate) struct Daemon {
    lines: BufReader<UnixStream>,
    /// Lines that were read to recognise the conversation.
    received: VecDeque<String>,
    /// Connections that are ready for a stop.
    _for_stops: Vec<UnixStream>,
}

/// Takes the next client and greets it.
pub(crate) fn greet(listener: &UnixListener, hello: &str) -> UnixStream {
    let (mut stream, _) = listener.accept().expect("a client");
    stream.set_read_timeout(Some(LIMIT)).expect("a time-out");
    writeln!(stream, "{hello}").unwrap_or(());
    stream
}

pub(crate) fn is_stop(line: &str) -> bool {
    Envelope::parse(line).is_ok_and(|envelope| envelope.request == Request::Stop {})
}

impl Daemon {
    /// Takes the panel's next conversation. A connection with stops alone is the panel's other one, and is
    /// kept waiting.
    pub(crate) fn accept(listener: &UnixListener) -> Self {
        let mut for_stops: Vec<(BufReader<UnixStream>, VecDeque<String>)> = Vec::new();
        listener.set_nonblocking(true).expect("it can be");
        let (began, mut accepted) = (Instant::now(), None);
        loop {
            assert!(began.elapsed() < LIMIT, "no conversation in time");
            // A conversation speaks soon; the connection for stops, which comes after it, is left to who waits for it.
            let is_silent = accepted.is_none_or(|at: Instant| at.elapsed() > Duration::from_millis(500));
            if is_silent && let Ok((mut stream, _)) = listener.accept() {
                accepted = Some(Instant::now());
                stream.set_nonblocking(false).expect("it can be");
                writeln!(stream, "{HELLO}").unwrap_or(());
                stream
                    .set_read_timeout(Some(Duration::from_millis(5)))
                    .expect("a time-out");
                for_stops.push((BufReader::new(stream), VecDeque::new()));
            }
            for place in 0..for_stops.len() {
                let (lines, received) = &mut for_stops[place];
                let mut line = String::new();
                if lines.read_line(&mut line).is_ok_and(|read| read > 0) {
                    received.push_back(line);
                }
                if received.iter().any(|line| !is_stop(line)) {
                    let (lines, received) = for_stops.swap_remove(place);
                    lines.get_ref().set_read_timeout(Some(LIMIT)).expect("a time-out");
                    listener.set_nonblocking(false).expect("it can be");
                    return Self {
                        lines,
                        received,
                        _for_stops: for_stops.into_iter().map(|(lines, _)| lines.into_inner()).collect(),
                    };
                }
            }
        }
    }

    pub(crate) fn say(&mut self, line: &str) {
        writeln!(self.lines.get_mut(), "{line}").expect("the client listens");
    }

    /// The next request. Requests for the scene are answered here.
    pub(crate) fn hear(&mut self) -> Envelope {
        loop {
            let line = self.received.pop_front().unwrap_or_else(|| {
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
    pub(crate) fn answer(&mut self, id: u64, ok: &str) {
        self.say(&format!(r#"{{"id":{id},"ok":{ok}}}"#));
    }

    pub(crate) fn refuse(&mut self, id: u64, error: &WireError) {
        let error = serde_json::to_string(error).expect("writes");
        self.say(&format!(r#"{{"id":{id},"error":{error}}}"#));
    }

    pub(crate) fn report(&mut self, state: &StateEvent) {
        self.say(&serde_json::to_string(&Event::State(state.clone())).expect("an event"));
    }

    /// Takes a request for advice.
    pub(crate) fn hear_advise(&mut self) -> u64 {
        let advise = self.hear();
        assert_eq!(advise.request, Request::Advise {});
        advise.id
    }

    /// Answers the first requests of a panel.
    pub(crate) fn introduce(&mut self) {
        let describe = self.hear();
        assert_eq!(describe.request, Request::Describe {});
        self.answer(describe.id, r#"{"parameters":[],"sample_columns":[]}"#);
        let subscribe = self.hear();
        let Request::Subscribe { topics, .. } = subscribe.request else {
            panic!("{subscribe:?}");
        };
        assert_eq!(
            topics,
            [Topic::State, Topic::Timing, Topic::Samples, Topic::Snapshot, Topic::Log]
        );
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

pub(crate) fn scene_reply() -> String {
    let scene = Scene::paper();
    let reply = SceneReply {
        revision: 1,
        params: params_of(&scene),
        scene,
    };
    serde_json::to_string(&reply).expect("a reply")
}

pub(crate) struct Bench {
    pub(crate) dir: tempfile::TempDir,
    pub(crate) connection: Connection,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with_patience(Patience {
            retry: Duration::from_millis(5),
            silence: LIMIT,
        })
    }

    pub(crate) fn with_patience(patience: Patience) -> Self {
        let dir = tempfile::tempdir().expect("a directory");
        let path = socket(dir.path());
        let connection = Connection::start(move || path.clone(), patience, |_| {}).expect("threads");
        Self { dir, connection }
    }

    pub(crate) fn listen(&self) -> UnixListener {
        UnixListener::bind(socket(self.dir.path())).expect("a socket")
    }

    /// Ends the daemon like a process that dies, and removes the file of its socket.
    pub(crate) fn end(&self, listener: UnixListener) {
        drop(listener);
        std::fs::remove_file(socket(self.dir.path())).expect("the socket is there");
    }

    /// Waits for the first update that `pick` takes.
    pub(crate) fn until<T>(&self, pick: impl Fn(Update) -> Option<T>) -> T {
        loop {
            let update = self.connection.wait(LIMIT).expect("news in time");
            if let Some(found) = pick(update) {
                return found;
            }
        }
    }

    pub(crate) fn until_connected(&self) {
        self.until(|update| {
            matches!(update, Update::Connected { hello, .. } if hello.server == "hapticd test").then_some(())
        });
    }

    pub(crate) fn until_lost(&self) -> String {
        self.until(|update| match update {
            Update::Disconnected { reason, .. } => Some(reason),
            _ => None,
        })
    }

    pub(crate) fn until_stop_news(&self) -> StopNews {
        self.until(|update| match update {
            Update::Stop(news) => Some(news),
            _ => None,
        })
    }
}

pub(crate) fn of_revision(revision: u64) -> StateEvent {
    StateEvent {
        revision,
        ..state_event(RigState::Idle, 5)
    }
}

pub(crate) fn advised(update: Update) -> Option<Result<AdviceReply, WireError>> {
    match update {
        Update::Advised(result) => Some(result),
        _ => None,
    }
}

pub(crate) fn socket(dir: &Path) -> PathBuf {
    dir.join("control.sock")
}

/// The panel's connection for stops, which comes after its conversation.
pub(crate) struct StopLine(pub(crate) BufReader<UnixStream>);

impl StopLine {
    pub(crate) fn accept(listener: &UnixListener) -> Self {
        Self(BufReader::new(greet(listener, HELLO)))
    }

    /// The number of the next stop.
    pub(crate) fn hear(&mut self) -> u64 {
        let mut line = String::new();
        self.0.read_line(&mut line).expect("a stop in time");
        let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line:?}: {error:?}"));
        assert_eq!(envelope.request, Request::Stop {});
        envelope.id
    }

    pub(crate) fn confirm(&mut self, id: u64) {
        writeln!(self.0.get_mut(), r#"{{"id":{id},"ok":{{"state":"stopped","tick":9}}}}"#).expect("the panel listens");
    }
}

/// A daemon that has answered the first requests of a panel.
pub(crate) fn introduced() -> (Bench, UnixListener, Daemon) {
    let bench = Bench::new();
    let listener = bench.listen();
    let mut daemon = Daemon::accept(&listener);
    daemon.introduce();
    bench.until_connected();
    (bench, listener, daemon)
}

/// A daemon on the panel's two connections.
pub(crate) fn connected() -> (Bench, UnixListener, Daemon, StopLine) {
    let (bench, listener, daemon) = introduced();
    let stops = StopLine::accept(&listener);
    (bench, listener, daemon, stops)
}
