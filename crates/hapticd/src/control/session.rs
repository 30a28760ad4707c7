//! One client: reads its lines, answers each, and sends it its events.

use crate::control::change::{self, Begun, How};
use crate::control::requester::Requester;
use crate::control::{
    RigHandle, advise, commission, describe, devices, diff, drive, get, lease, library, log, status, subscribe, timing,
};
use crate::telemetry::feed::{BACKLOG_BYTES, BACKLOG_LINES, Line};
use haptic_core::servo::Command;
use haptic_ipc::{
    BadLine, Envelope, ErrorCode, Hello, MAX_LINE_BYTES, PROTOCOL_VERSION, Peer, Request, Rights, WireError,
};
use serde::Serialize;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::bytes::BytesMut;
use tokio_util::codec::{Decoder, LinesCodec, LinesCodecError};

/// How long a client may leave its lines unread.
const BLOCKED_FOR: Duration = Duration::from_secs(2);

/// Clients served at once.
pub(super) const MOST_CLIENTS: usize = 32;

/// Bytes of a client's requests that may wait to be answered, with what each takes beside its text, of its changes that may wait to be rendered, and of answers that may wait to be written to it; a
/// longer one waits alone. A client that pipelines more, some thousand requests, is read no further until there is room. What is read of a client, and what
/// it leaves unread, is held in memory that is locked.
const WAITING_BYTES: usize = 256 * 1024;

/// Bytes that are looked through for stops when nobody answers a client any more: more than a socket holds.
const LAST_BYTES: usize = 1024 * 1024;

/// A name and its value, with the name's own piece of memory.
const BYTES_OF_A_CHANGE: usize = 96;

/// Changes of a client that may be on their way to the real-time thread at once.
const CHANGES_UNDER_WAY: usize = 64;

/// Talks to one client until it goes.
pub(super) async fn run(rig: Rc<RigHandle>, stream: UnixStream, session: u64, peer: Peer, rights: Rights) {
    let (reader, writer) = stream.into_split();
    let mut incoming = Lines::new(reader);
    let (lines, outgoing) = mpsc::channel(BACKLOG_LINES);
    // What it holds is bounded by the room that each request takes.
    let (requests, waiting) = mpsc::unbounded_channel();
    let writing = tokio::task::spawn_local(write(writer, outgoing));
    let client = Client {
        rig,
        lines,
        unwritten: room(),
        unrendered: room(),
        events: Arc::new(Semaphore::new(BACKLOG_BYTES)),
        session,
        peer,
        rights,
    };
    // Reading and answering side by side: a stop acts when it is read, not when its turn to be answered comes. When the writer gives up
    // on a client that does not read, the conversation ends too.
    tokio::select! {
        ((), ()) = async { tokio::join!(client.read(&mut incoming, requests), client.converse(waiting)) } => {}
        () = client.lines.closed() => {}
    }
    client.raise_last_stops(&mut incoming).await;
    client.rig.feed().unsubscribe(session);
    commission::gone(&client.rig, session);
    lease::gone(&client.rig, session).await;
    drop(client);
    // What is still queued is written, or given up after the time that every line has.
    drop(writing.await);
}

/// Room for what waits.
fn room() -> Arc<Semaphore> {
    Arc::new(Semaphore::new(WAITING_BYTES))
}

/// Waits until there is room for so many bytes.
async fn take_room(room: &Arc<Semaphore>, bytes: usize) -> Option<OwnedSemaphorePermit> {
    let bytes = u32::try_from(bytes.clamp(1, WAITING_BYTES)).ok()?;
    Arc::clone(room).acquire_many_owned(bytes).await.ok()
}

/// What a client sends, line by line.
struct Lines {
    reader: OwnedReadHalf,
    codec: LinesCodec,
    buffer: BytesMut,
    ended: bool,
}

impl Lines {
    fn new(reader: OwnedReadHalf) -> Self {
        Self {
            reader,
            codec: LinesCodec::new_with_max_length(MAX_LINE_BYTES),
            buffer: BytesMut::new(),
            ended: false,
        }
    }

    /// The next line of what has come. What a client leaves without a line's end before it goes is one too: no part of a request reads as a whole one.
    fn next(&mut self) -> Option<Result<String, LinesCodecError>> {
        let decoded = if self.ended {
            self.codec.decode_eof(&mut self.buffer)
        } else {
            self.codec.decode(&mut self.buffer)
        };
        decoded.transpose()
    }

    /// Waits for more; says whether there is more to look at, be it only the end.
    async fn wait(&mut self) -> bool {
        if self.ended {
            return false;
        }
        self.ended = !matches!(self.reader.read_buf(&mut self.buffer).await, Ok(1..));
        true
    }

    /// Takes in what has come by now, without waiting; says how much.
    fn take_in(&mut self) -> usize {
        let mut chunk = [0; 16 * 1024];
        // Asked of the system itself: what the runtime knows of the socket may be old.
        let came = rustix::io::read(self.reader.as_ref(), &mut chunk[..]).unwrap_or(0);
        self.buffer.extend_from_slice(&chunk[..came]);
        came
    }
}

/// A line that waits for its turn, and the room that it takes meanwhile.
struct Waiting {
    incoming: Incoming,
    room: Option<OwnedSemaphorePermit>,
}

/// A line, as it was read.
enum Incoming {
    /// A request, with the stops that had been asked for when it came, its own among them.
    Request { envelope: Envelope, stops: u64 },
    /// Something that is no request.
    Refused { id: Option<u64>, error: WireError },
}

impl Incoming {
    /// Bytes that it takes in memory beside those of its text.
    fn beside_its_text(&self) -> usize {
        let changes = match self {
            Self::Request {
                envelope:
                    Envelope {
                        request: Request::Set { params, .. },
                        ..
                    },
                ..
            } => params.0.len(),
            _ => 0,
        };
        size_of::<Waiting>() + changes * BYTES_OF_A_CHANGE
    }
}

/// Writes the lines queued for a client, until there are no more or the client does not read them.
async fn write(mut writer: OwnedWriteHalf, mut outgoing: mpsc::Receiver<Line>) {
    while let Some(Line { text, room }) = outgoing.recv().await {
        let written = tokio::time::timeout(BLOCKED_FOR, writer.write_all(text.as_bytes())).await;
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
        drop(room);
    }
}

struct Client {
    rig: Rc<RigHandle>,
    lines: mpsc::Sender<Line>,
    /// Room for answers.
    unwritten: Arc<Semaphore>,
    /// Room for changes that have none yet.
    unrendered: Arc<Semaphore>,
    /// Room for events.
    events: Arc<Semaphore>,
    session: u64,
    peer: Peer,
    rights: Rights,
}

/// A change that the real-time thread has yet to render before it can be answered.
struct UnderWay {
    id: u64,
    change: Begun,
    room: Option<OwnedSemaphorePermit>,
}

/// What comes of a request.
enum Answer {
    Now(String),
    OnceRendered(UnderWay),
}

/// Whether a request need not wait until the ones before are answered.
fn is_change(request: &Request) -> bool {
    matches!(
        request,
        Request::Set { .. } | Request::SceneLoad { .. } | Request::Undo { .. } | Request::Redo { .. }
    )
}

impl Client {
    /// Reads the client's lines until it hangs up. Raises its stops at once.
    async fn read(&self, lines: &mut Lines, requests: mpsc::UnboundedSender<Waiting>) {
        let unanswered = room();
        loop {
            while let Some(line) = lines.next() {
                lease::renew(&self.rig, self.session);
                let bytes = line.as_ref().map_or(0, String::len);
                let Some(incoming) = self.heard(line) else { continue };
                // A stop has been raised by now, whether or not there is room.
                let room = take_room(&unanswered, bytes + incoming.beside_its_text()).await;
                let waiting = Waiting { incoming, room };
                if requests.send(waiting).is_err() {
                    return;
                }
                // One client with much to say must not keep the others waiting.
                tokio::task::yield_now().await;
            }
            if !lines.wait().await {
                return;
            }
        }
    }

    /// What a line asks for, with its stop raised; nothing where it is blank.
    fn heard(&self, line: Result<String, LinesCodecError>) -> Option<Incoming> {
        let rig = &*self.rig;
        let line = match line {
            Ok(line) if line.trim().is_empty() => return None,
            Ok(line) => line,
            Err(error) => {
                let error = unreadable(&error);
                return Some(Incoming::Refused { id: None, error });
            }
        };
        Some(match Envelope::parse(&line) {
            Ok(envelope) => Incoming::Request {
                stops: match envelope.request {
                    Request::Stop {} => rig.raise_stop(&self.peer),
                    _ => rig.stops(),
                },
                envelope,
            },
            Err(BadLine { id, error, means_stop }) => {
                if means_stop {
                    rig.raise_stop(&self.peer);
                }
                Incoming::Refused { id, error }
            }
        })
    }

    /// Raises the stops in what was sent and not read any more: a client that asks for one and hangs up at once has asked for it. Nothing else of that
    /// is done, as there is nobody to hear of it.
    async fn raise_last_stops(&self, lines: &mut Lines) {
        let mut left = LAST_BYTES;
        loop {
            while let Some(line) = lines.next() {
                drop(self.heard(line));
                // Others have their turn here too.
                tokio::task::yield_now().await;
            }
            if lines.ended {
                return;
            }
            let came = lines.take_in();
            // Of a line that has no end yet, what is there must do.
            lines.ended = came == 0 || came > left;
            left = left.saturating_sub(came);
        }
    }

    async fn converse(&self, mut waiting: mpsc::UnboundedReceiver<Waiting>) {
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            server: self.rig.facts.server.clone(),
            session: self.peer.session.clone(),
            rights: self.rights,
        };
        if self.say(line(&Greeting { hello })).await.is_err() {
            return;
        }
        // A change need not be rendered before the next is begun: a client may send more of them than there are ticks.
        let mut under_way = VecDeque::new();
        loop {
            let next = tokio::select! {
                biased;
                reply = self.rendered(&under_way), if !under_way.is_empty() => {
                    under_way.pop_front();
                    if self.say(reply).await.is_err() {
                        return;
                    }
                    continue;
                }
                next = waiting.recv(), if under_way.len() < CHANGES_UNDER_WAY => next,
            };
            let Some(Waiting { incoming, room }) = next else {
                // Whether it hears or not: there is nothing more to do for it.
                self.settle(&mut under_way).await.unwrap_or_default();
                return;
            };
            let reply = match incoming {
                Incoming::Request { envelope, stops } => {
                    if !is_change(&envelope.request) && self.settle(&mut under_way).await.is_err() {
                        return;
                    }
                    match self.take_up(envelope, stops).await {
                        Answer::Now(reply) => Some(reply),
                        Answer::OnceRendered(change) => {
                            if self.admit(change, &mut under_way).await.is_err() {
                                return;
                            }
                            None
                        }
                    }
                }
                Incoming::Refused { id, error } => Some(answer::<()>(id, Err(error))),
            };
            drop(room);
            if let Some(reply) = reply
                && (self.settle(&mut under_way).await.is_err() || self.say(reply).await.is_err())
            {
                return;
            }
            // One client with much to ask must not keep the others waiting.
            tokio::task::yield_now().await;
        }
    }

    /// Waits for the oldest change to be rendered; gives its answer.
    async fn rendered(&self, under_way: &VecDeque<UnderWay>) -> String {
        match under_way.front() {
            Some(UnderWay { id, change, .. }) => answer(Some(*id), change.finished(&self.rig).await),
            None => std::future::pending().await,
        }
    }

    /// Puts a change under way, behind as many answers as it needs the room of.
    async fn admit(&self, mut change: UnderWay, under_way: &mut VecDeque<UnderWay>) -> Result<(), Gone> {
        let bytes = change.change.bytes();
        while !under_way.is_empty() && self.unrendered.available_permits() < bytes.min(WAITING_BYTES) {
            let reply = self.rendered(under_way).await;
            under_way.pop_front();
            self.say(reply).await?;
        }
        // Nobody else has any of it.
        change.room = take_room(&self.unrendered, bytes).await;
        under_way.push_back(change);
        Ok(())
    }

    /// Answers all changes that are under way.
    async fn settle(&self, under_way: &mut VecDeque<UnderWay>) -> Result<(), Gone> {
        while !under_way.is_empty() {
            let reply = self.rendered(under_way).await;
            under_way.pop_front();
            self.say(reply).await?;
        }
        Ok(())
    }

    /// Why the client may not ask this, if it may not.
    fn refusal(&self, request: &Request) -> Option<WireError> {
        match self.rights {
            Rights::All => None,
            Rights::Watch => (!request.is_for_watchers()).then(only_watching),
            // Nobody is given rights that have no name yet; a stop is everybody's.
            Rights::Stop | Rights::Unknown => (*request != (Request::Stop {})).then(no_place),
        }
    }

    fn by(&self) -> Requester<'_> {
        Requester {
            session: self.session,
            peer: &self.peer,
        }
    }

    /// Does what is asked, or begins it where it is a change of the scene.
    async fn take_up(&self, envelope: Envelope, stops: u64) -> Answer {
        let id = Some(envelope.id);
        let (rig, by) = (&*self.rig, self.by());
        if let Some(refusal) = self.refusal(&envelope.request) {
            return Answer::Now(answer::<()>(id, Err(refusal)));
        }
        let command = async |command| drive::command(rig, command, stops, by.peer).await;
        let begun = |begun: Result<Begun, WireError>| match begun {
            Ok(change) => Answer::OnceRendered(UnderWay {
                id: envelope.id,
                change,
                room: None,
            }),
            Err(error) => Answer::Now(answer::<()>(id, Err(error))),
        };
        let how = |if_revision, ramp_ms, dry_run| How {
            if_revision,
            ramp_ms,
            dry_run,
        };
        Answer::Now(match envelope.request {
            Request::Set {
                params,
                if_revision,
                ramp_ms,
                dry_run,
                merge,
            } => {
                let how = how(if_revision, ramp_ms, dry_run);
                return begun(change::set(rig, by, &params, merge, how));
            }
            Request::SceneLoad {
                scene,
                if_revision,
                ramp_ms,
                dry_run,
            } => return begun(change::load(rig, by, scene, how(if_revision, ramp_ms, dry_run)).await),
            Request::Undo {
                if_revision,
                ramp_ms,
                dry_run,
            } => return begun(change::undo(rig, by, how(if_revision, ramp_ms, dry_run))),
            Request::Redo {
                if_revision,
                ramp_ms,
                dry_run,
            } => return begun(change::redo(rig, by, how(if_revision, ramp_ms, dry_run))),
            Request::Describe {} => answer(id, Ok(describe::describe(rig))),
            Request::Get { scene } => answer(id, get::get(rig, scene).await),
            Request::SceneSave { name, scene, replace } => {
                answer(id, library::save(rig, by.peer, name, scene, replace).await)
            }
            Request::SceneList {} => answer(id, library::list(rig).await),
            Request::SceneDiff { from, to } => answer(id, diff::diff(rig, from, to).await),
            Request::Engage {} => answer(id, command(Command::Engage).await),
            Request::Release {} => answer(id, command(Command::Release).await),
            Request::Reset {} => answer(id, command(Command::Reset).await),
            Request::Stop {} => answer(id, drive::stopped(rig, stops).await),
            Request::Status {} => answer(id, Ok(status::status(rig).await)),
            Request::Timing {} => answer(id, Ok(timing::timing(rig))),
            Request::Devices { probe } => answer(id, devices::devices(rig, probe).await),
            Request::Advise {} => answer(id, Ok(advise::advise(rig))),
            Request::Subscribe {
                topics,
                rate_hz,
                batch_ms,
            } => {
                let reply = subscribe::subscribe(
                    rig,
                    self.session,
                    (&self.lines, &self.events),
                    &topics,
                    rate_hz,
                    batch_ms,
                );
                answer(id, reply)
            }
            Request::Log { after, limit } => answer(id, Ok(log::log(rig, after, limit))),
            Request::Lease { timeout_ms } => answer(id, lease::lease(rig, by, timeout_ms)),
            Request::CommissionBegin {} => answer(id, commission::begin(rig, by).await),
            Request::CommissionPulse { force_n, duration_ms } => {
                answer(id, commission::pulse(&self.rig, by, force_n, duration_ms).await)
            }
            Request::CommissionStatus {} => answer(id, commission::status(rig, by)),
            Request::CommissionStore { range_m, friction_n } => {
                answer(id, commission::store(rig, by, range_m, friction_n).await)
            }
            Request::CommissionEnd {} => answer(id, commission::end(rig, by)),
        })
    }

    async fn say(&self, text: String) -> Result<(), Gone> {
        let room = take_room(&self.unwritten, text.len()).await;
        self.lines.send(Line { text, room }).await.map_err(|_| Gone)
    }
}

/// The client does not listen any more.
struct Gone;

/// The first line.
#[derive(Serialize)]
struct Greeting {
    hello: Hello,
}

/// An answer. Written as it stands, without a tree of values in between: some are long.
#[derive(Serialize)]
struct Reply<T> {
    id: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ok: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<WireError>,
}

fn answer<T: Serialize>(id: Option<u64>, result: Result<T, WireError>) -> String {
    let (ok, error) = match result {
        Ok(ok) => (Some(ok), None),
        Err(error) => (None, Some(error)),
    };
    line(&Reply { id, ok, error })
}

fn line(message: &impl Serialize) -> String {
    let mut line = serde_json::to_string(message).expect("messages hold nothing that JSON cannot");
    line.push('\n');
    line
}

fn no_place() -> WireError {
    let message =
        format!("{MOST_CLIENTS} clients are connected, the most that are served: close one first; you may only stop");
    WireError::new(ErrorCode::TooManyClients, message)
}

fn only_watching() -> WireError {
    let message = "this socket is for watching and for stopping: connect to the control socket to change anything";
    WireError::new(ErrorCode::ReadOnly, message)
}

fn unreadable(error: &LinesCodecError) -> WireError {
    match error {
        LinesCodecError::MaxLineLengthExceeded => WireError {
            max: u32::try_from(MAX_LINE_BYTES).ok().map(f64::from),
            unit: Some("bytes".to_owned()),
            ..WireError::new(
                ErrorCode::LineTooLong,
                format!("the line is longer than the limit of {MAX_LINE_BYTES} bytes"),
            )
            .about("line")
        },
        LinesCodecError::Io(error) => WireError::new(ErrorCode::BadJson, format!("the line cannot be read: {error}")),
    }
}
