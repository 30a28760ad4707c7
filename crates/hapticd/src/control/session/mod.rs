//! One client: reads its lines, answers each, and sends its events.

mod dispatch;
mod lines;

use crate::control::change::PendingChange;
use crate::control::places::Newcomer;
use crate::control::rig::ReadAfter;
use crate::control::session::dispatch::{answer, line};
use crate::control::session::lines::{Lines, unreadable};
use crate::control::{RigHandle, exclusive_use, lease};
use crate::telemetry::subscribers::{BACKLOG_BYTES, BACKLOG_LINES, ClientLine};
use haptic_ipc::{BadLine, Envelope, Hello, PROTOCOL_VERSION, Peer, Request, Rights, WireError};
use serde::Serialize;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::net::UnixStream;
use tokio::net::unix::OwnedWriteHalf;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::codec::LinesCodecError;

/// How long a client may leave its lines unread.
const BLOCKED_FOR: Duration = Duration::from_secs(2);

/// Bytes that a newcomer may send without a stop among them.
const NEWCOMER_BYTES: usize = 4096;

/// Bytes searched for stops after the last answer: more than a socket's buffer.
const LAST_BYTES: usize = 1024 * 1024;

/// Bytes of a client's lines that may wait to be answered. The daemon stops reading from a client that pipelines more,
/// some thousand requests, until there is room. A request takes up to sixteen times the memory of its line, all of it
/// locked.
const WAITING_BYTES: usize = 128 * 1024;

/// What a line takes of them at least.
const MIN_LINE_BYTES: usize = 128;

/// Most changes of a client that wait for the real-time thread.
const MAX_PENDING: usize = 64;

/// A client that is served.
struct Client {
    rig: Rc<RigHandle>,
    lines: mpsc::Sender<ClientLine>,
    /// Room for an answer: the next one waits until it is written.
    unwritten: Arc<Semaphore>,
    /// Room for events.
    events: Arc<Semaphore>,
    session: u64,
    peer: Peer,
    rights: Rights,
    /// It has no place.
    newcomer: Option<Rc<Newcomer>>,
}

/// The answer to a request.
enum Answer {
    Now(String),
    /// To a change that the real-time thread has yet to render, by the number of its request.
    OnceRendered(u64, PendingChange),
}

/// Changes that wait for their answer.
type Pending = VecDeque<(u64, PendingChange)>;

/// The client has closed its connection.
struct Closed;

/// Serves one client until it closes its connection; a newcomer for a moment.
pub(super) async fn run(
    rig: Rc<RigHandle>,
    stream: UnixStream,
    session: u64,
    peer: Peer,
    rights: Rights,
    newcomer: Option<Rc<Newcomer>>,
) {
    let (reader, writer) = stream.into_split();
    let mut incoming = Lines::new(reader);
    let (lines, outgoing) = mpsc::channel(BACKLOG_LINES);
    // Its contents are bounded by the room that each request takes.
    let (requests, waiting) = mpsc::unbounded_channel();
    let writing = tokio::task::spawn_local(write(writer, outgoing));
    let client = Client {
        rig,
        lines,
        unwritten: Arc::new(Semaphore::new(1)),
        events: Arc::new(Semaphore::new(BACKLOG_BYTES)),
        session,
        peer,
        rights,
        newcomer,
    };
    // Reading and answering run side by side: a stop acts when it is read, before the requests that
    // are queued ahead of it. The conversation ends when the writer gives up on a client that does
    // not read.
    tokio::select! {
        ((), ()) = async { tokio::join!(client.read(&mut incoming, requests), client.converse(waiting)) } => {}
        () = client.lines.closed() => {}
        () = client.is_over() => client.send_away(),
    }
    client.raise_last_stops(&mut incoming).await;
    if client.newcomer.is_some() {
        // It has taken nothing, and its place is for the next one: what can be sent to it goes into its buffer now.
        drop(client);
        tokio::task::yield_now().await;
        writing.abort();
        return;
    }
    client.rig.feed().subscribers.unsubscribe(session);
    client.left().await;
    client.rig.leases.forget(session);
    drop(client);
    // Queued lines are written, or given up after the timeout of every line.
    drop(writing.await);
}

/// A line that waits to be answered, and the room that it takes.
struct QueuedLine {
    incoming: ReceivedLine,
    room: Option<OwnedSemaphorePermit>,
}

/// A line after it was parsed.
enum ReceivedLine {
    Request {
        envelope: Envelope,
        read_after: ReadAfter,
    },
    /// A line that is not a request.
    Refused {
        id: Option<u64>,
        error: WireError,
    },
}

impl ReceivedLine {
    /// Whether it brings force, or lets others bring it.
    const fn may_bring_force(&self) -> bool {
        match self {
            Self::Request { envelope, .. } => matches!(envelope.request, Request::Engage { .. } | Request::Reset {}),
            Self::Refused { .. } => false,
        }
    }
}

/// Writes the lines queued for a client, until the queue closes or the client stops reading.
async fn write(mut writer: OwnedWriteHalf, mut outgoing: mpsc::Receiver<ClientLine>) {
    while let Some(ClientLine { text, room }) = outgoing.recv().await {
        let written = tokio::time::timeout(BLOCKED_FOR, writer.write_all(text.as_bytes())).await;
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
        drop(room);
    }
}

/// Waits for so much room.
async fn take(room: &Arc<Semaphore>, amount: usize) -> Option<OwnedSemaphorePermit> {
    Arc::clone(room)
        .acquire_many_owned(u32::try_from(amount).ok()?)
        .await
        .ok()
}

/// Whether a request changes the scene: it may begin before earlier ones are answered.
fn is_change(request: &Request) -> bool {
    matches!(
        request,
        Request::Set { .. } | Request::SceneLoad { .. } | Request::Undo { .. } | Request::Redo { .. }
    )
}

impl Client {
    /// Until a newcomer has been listened to for long enough; for ever for others.
    async fn is_over(&self) {
        match &self.newcomer {
            Some(newcomer) => newcomer.over().await,
            None => std::future::pending().await,
        }
    }

    /// Whether a newcomer has sent more than a stop needs, and none.
    fn has_sent_too_much(&self, lines: &Lines) -> bool {
        self.newcomer
            .as_ref()
            .is_some_and(|newcomer| newcomer.is_silent() && lines.received > NEWCOMER_BYTES)
    }

    /// Tells a newcomer why it is not listened to any longer.
    fn send_away(&self) {
        let text = answer::<()>(None, Err(self.only_stopping()));
        // Where its answers have filled the queue, it reads nothing.
        drop(self.lines.try_send(ClientLine { text, room: None }));
    }

    /// Raises a stop at once.
    fn raise_stop(&self) -> u64 {
        if let Some(newcomer) = &self.newcomer {
            newcomer.asks_for_a_stop();
        }
        self.rig.raise_stop(&self.peer)
    }

    /// Reads the client's lines until it closes its connection. Raises its stops at once.
    async fn read(&self, lines: &mut Lines, requests: mpsc::UnboundedSender<QueuedLine>) {
        let unanswered = Arc::new(Semaphore::new(WAITING_BYTES));
        loop {
            while let Some(line) = lines.next() {
                let bytes = line.as_ref().map_or(0, String::len).max(MIN_LINE_BYTES);
                let incoming = self.receive(line);
                // Later: a lapse that comes to light by it wins over the line.
                lease::renew(&self.rig, self.session);
                let Some(incoming) = incoming else { continue };
                // Its client has given up, maybe long ago, and has told a person so.
                if incoming.may_bring_force() && lines.is_hung_up() {
                    continue;
                }
                // A stop is already raised, whether or not there is room.
                let room = take(&unanswered, bytes).await;
                let waiting = QueuedLine { incoming, room };
                if requests.send(waiting).is_err() {
                    return;
                }
                // A client with many lines must not keep the others waiting.
                tokio::task::yield_now().await;
            }
            if !lines.wait().await || self.has_sent_too_much(lines) {
                break;
            }
        }
        // Its last requests may wait for a disk.
        self.left().await;
    }

    /// Takes the force away that depends on the client, which sends nothing more. The conversation may be given up
    /// meanwhile, as that of a client that does not take its events any more: the release is carried out all the same.
    async fn left(&self) {
        let why = "its client has closed the connection";
        // A motion ends at once, instead of along the ramp of the expired lease.
        exclusive_use::end(&self.rig, self.session, why);
        self.rig.end_schedule_of(self.session, why);
        let (rig, session) = (Rc::clone(&self.rig), self.session);
        let release = tokio::task::spawn_local(async move { lease::closed(&rig, session).await });
        drop(release.await);
    }

    /// Parses a line and raises its stop; `None` for a blank line.
    fn receive(&self, line: Result<String, LinesCodecError>) -> Option<ReceivedLine> {
        let line = match line {
            Ok(line) if line.trim().is_empty() => return None,
            Ok(line) => line,
            Err(error) => {
                let error = unreadable(&error);
                return Some(ReceivedLine::Refused { id: None, error });
            }
        };
        Some(match Envelope::parse(&line) {
            Ok(envelope) => ReceivedLine::Request {
                read_after: ReadAfter {
                    stops: match envelope.request {
                        Request::Stop {} => self.raise_stop(),
                        _ => self.rig.channel.stops(),
                    },
                    lapses: self.rig.leases.lapses(self.session),
                },
                envelope,
            },
            Err(BadLine { id, error, means_stop }) => {
                if means_stop {
                    self.raise_stop();
                }
                ReceivedLine::Refused { id, error }
            }
        })
    }

    /// Raises the stops among the lines that were sent and not read yet: a client may ask for a
    /// stop and close its connection at once. Other requests are dropped, since nobody waits for an
    /// answer.
    async fn raise_last_stops(&self, lines: &mut Lines) {
        let mut left = if self.newcomer.is_some() {
            NEWCOMER_BYTES
        } else {
            LAST_BYTES
        };
        loop {
            while let Some(line) = lines.next() {
                drop(self.receive(line));
                // Other clients have their turn here too.
                tokio::task::yield_now().await;
            }
            if lines.ended {
                return;
            }
            let read = lines.read_now();
            // An unterminated line counts as a line.
            lines.ended = read == 0 || read > left;
            left = left.saturating_sub(read);
        }
    }

    async fn converse(&self, mut waiting: mpsc::UnboundedReceiver<QueuedLine>) {
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            server: self.rig.facts.server.clone(),
            session: self.peer.session.clone(),
            rights: self.rights,
        };
        if self.send(line(&Greeting { hello })).await.is_err() {
            return;
        }
        // A change begins before the previous one is rendered: a client may send more changes than
        // there are ticks.
        let mut pending = Pending::new();
        loop {
            let next = tokio::select! {
                biased;
                reply = self.rendered(&pending), if !pending.is_empty() => {
                    pending.pop_front();
                    if self.send(reply).await.is_err() {
                        return;
                    }
                    continue;
                }
                next = waiting.recv(), if pending.len() < MAX_PENDING => next,
            };
            let Some(QueuedLine { incoming, room }) = next else {
                // The session ends, whether or not the client reads these answers.
                self.settle(&mut pending).await.unwrap_or_default();
                return;
            };
            let reply = match incoming {
                ReceivedLine::Request { envelope, read_after } => {
                    if !is_change(&envelope.request) && self.settle(&mut pending).await.is_err() {
                        return;
                    }
                    match self.dispatch(envelope, read_after).await {
                        Answer::Now(reply) => Some(reply),
                        Answer::OnceRendered(id, change) => {
                            pending.push_back((id, change));
                            None
                        }
                    }
                }
                ReceivedLine::Refused { id, error } => Some(answer::<()>(id, Err(error))),
            };
            drop(room);
            if let Some(reply) = reply
                && (self.settle(&mut pending).await.is_err() || self.send(reply).await.is_err())
            {
                return;
            }
            // A client with many requests must not keep the others waiting.
            tokio::task::yield_now().await;
        }
    }

    /// Waits until the oldest pending change is rendered; returns its answer.
    async fn rendered(&self, pending: &Pending) -> String {
        match pending.front() {
            Some((id, change)) => answer(Some(*id), change.finished(&self.rig).await),
            None => std::future::pending().await,
        }
    }

    /// Queues a line for the client, once there is room for it.
    async fn send(&self, text: String) -> Result<(), Closed> {
        let room = take(&self.unwritten, 1).await;
        self.lines.send(ClientLine { text, room }).await.map_err(|_| Closed)
    }

    /// Answers all pending changes.
    async fn settle(&self, pending: &mut Pending) -> Result<(), Closed> {
        while !pending.is_empty() {
            let reply = self.rendered(pending).await;
            pending.pop_front();
            self.send(reply).await?;
        }
        Ok(())
    }
}

/// The first line that the daemon sends.
#[derive(Serialize)]
struct Greeting {
    hello: Hello,
}
