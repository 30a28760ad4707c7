//! One client: reads its lines, answers each, and sends it its events.

use crate::control::{RigHandle, advise, describe, devices, drive, get, set, status, subscribe, timing};
use crate::rig_state::Command;
use crate::telemetry::feed::BACKLOG_LINES;
use haptic_ipc::{BadLine, Envelope, ErrorCode, Hello, MAX_LINE_BYTES, PROTOCOL_VERSION, Peer, Request, WireError};
use serde::Serialize;
use serde_json::json;
use std::rc::Rc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::UnixStream;
use tokio::net::unix::OwnedWriteHalf;
use tokio::sync::mpsc;
use tokio_util::bytes::BytesMut;
use tokio_util::codec::{Decoder, LinesCodec, LinesCodecError};

/// How long a client may leave its lines unread.
const BLOCKED_FOR: Duration = Duration::from_secs(2);

/// Clients served at once.
pub(super) const MOST_CLIENTS: usize = 32;

/// Requests of a client that may wait to be answered. One that pipelines more is read no further until there is room.
const WAITING_REQUESTS: usize = 64;

/// What a client may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rights {
    /// Everything.
    All,
    /// What leaves everything as it is, and stop.
    Watch,
    /// Stop, as there is no place left for more.
    OnlyStop,
}

/// Talks to one client until it goes.
pub(super) async fn run(rig: Rc<RigHandle>, stream: UnixStream, session: u64, peer: Peer, rights: Rights) {
    let (mut reader, writer) = stream.into_split();
    let (lines, outgoing) = mpsc::channel(BACKLOG_LINES);
    let (requests, waiting) = mpsc::channel(WAITING_REQUESTS);
    let writing = tokio::task::spawn_local(write(writer, outgoing));
    let client = Client {
        rig,
        lines,
        session,
        peer,
        rights,
    };
    // Reading and answering side by side: a stop acts when it is read, not when its turn to be answered comes. When the writer gives up
    // on a client that does not read, the conversation ends too.
    tokio::select! {
        ((), ()) = async { tokio::join!(read(&client.rig, &mut reader, requests), client.converse(waiting)) } => {}
        () = client.lines.closed() => {}
    }
    client.rig.feed().unsubscribe(session);
    drop(client);
    // What is still queued is written, or given up after the time that every line has.
    drop(writing.await);
}

/// A line, as it was read.
enum Incoming {
    /// A request, with the stops that had been asked for when it came, its own among them.
    Request { envelope: Envelope, stops: u64 },
    /// Something that is no request.
    Refused { id: Option<u64>, error: WireError },
}

/// Reads a client's lines until it hangs up. Raises its stops at once.
async fn read(rig: &RigHandle, reader: &mut (impl AsyncReadExt + Unpin), requests: mpsc::Sender<Incoming>) {
    let mut codec = LinesCodec::new_with_max_length(MAX_LINE_BYTES);
    let mut buffer = BytesMut::new();
    loop {
        loop {
            let incoming = match codec.decode(&mut buffer) {
                Ok(None) => break,
                Ok(Some(line)) if line.trim().is_empty() => continue,
                Ok(Some(line)) => match Envelope::parse(&line) {
                    Ok(envelope) => Incoming::Request {
                        stops: match envelope.request {
                            Request::Stop {} => rig.raise_stop(),
                            _ => rig.stops(),
                        },
                        envelope,
                    },
                    Err(BadLine { id, error, means_stop }) => {
                        if means_stop {
                            rig.raise_stop();
                        }
                        Incoming::Refused { id, error }
                    }
                },
                Err(error) => Incoming::Refused {
                    id: None,
                    error: unreadable(&error),
                },
            };
            if requests.send(incoming).await.is_err() {
                return;
            }
        }
        // A client that hangs up in the middle of a line asked for nothing.
        if !matches!(reader.read_buf(&mut buffer).await, Ok(1..)) {
            return;
        }
    }
}

/// Writes the lines queued for a client, until there are no more or the client does not read them.
async fn write(mut writer: OwnedWriteHalf, mut outgoing: mpsc::Receiver<String>) {
    while let Some(line) = outgoing.recv().await {
        let written = tokio::time::timeout(BLOCKED_FOR, writer.write_all(line.as_bytes())).await;
        if !matches!(written, Ok(Ok(()))) {
            return;
        }
    }
}

struct Client {
    rig: Rc<RigHandle>,
    lines: mpsc::Sender<String>,
    session: u64,
    peer: Peer,
    rights: Rights,
}

impl Client {
    async fn converse(&self, mut waiting: mpsc::Receiver<Incoming>) {
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            server: self.rig.facts.server.clone(),
            session: self.peer.session.clone(),
        };
        if self.say(&json!({ "hello": hello })).await.is_err() {
            return;
        }
        while let Some(incoming) = waiting.recv().await {
            let reply = match incoming {
                Incoming::Request { envelope, stops } => self.answer(envelope, stops).await,
                Incoming::Refused { id, error } => answer::<()>(id, Err(error)),
            };
            if self.say(&reply).await.is_err() {
                return;
            }
            // One client with much to ask must not keep the others waiting.
            tokio::task::yield_now().await;
        }
    }

    async fn answer(&self, envelope: Envelope, stops: u64) -> serde_json::Value {
        let id = Some(envelope.id);
        let rig = &*self.rig;
        if self.rights == Rights::OnlyStop && envelope.request != (Request::Stop {}) {
            return answer::<()>(id, Err(no_place()));
        }
        if self.rights == Rights::Watch && !envelope.request.is_for_watchers() {
            return answer::<()>(id, Err(only_watching()));
        }
        match envelope.request {
            Request::Describe {} => answer(id, Ok(describe::describe(rig))),
            Request::Get { .. } => answer(id, Ok(get::get(rig))),
            Request::Set { params, .. } => answer(id, set::set(rig, &params).await),
            Request::Engage {} => answer(id, drive::command(rig, Command::Engage, stops).await),
            Request::Release {} => answer(id, drive::command(rig, Command::Release, stops).await),
            Request::Reset {} => answer(id, drive::command(rig, Command::Reset, stops).await),
            Request::Stop {} => answer(id, drive::stopped(rig, stops).await),
            Request::Status {} => answer(id, Ok(status::status(rig))),
            Request::Timing {} => answer(id, Ok(timing::timing(rig))),
            Request::Devices { probe } => answer(id, devices::devices(rig, probe).await),
            Request::Advise {} => answer(id, Ok(advise::advise(rig))),
            Request::Subscribe {
                topics,
                rate_hz,
                batch_ms,
            } => {
                let reply = subscribe::subscribe(rig, self.session, &self.lines, &topics, rate_hz, batch_ms);
                answer(id, reply)
            }
            _ => answer::<()>(id, Err(WireError::new(ErrorCode::UnknownOp, "not yet"))),
        }
    }

    async fn say(&self, message: &serde_json::Value) -> Result<(), Gone> {
        self.lines.send(format!("{message}\n")).await.map_err(|_| Gone)
    }
}

/// The client does not listen any more.
struct Gone;

fn answer<T: Serialize>(id: Option<u64>, result: Result<T, WireError>) -> serde_json::Value {
    match result {
        Ok(ok) => json!({ "id": id, "ok": ok }),
        Err(error) => json!({ "id": id, "error": error }),
    }
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
        LinesCodecError::MaxLineLengthExceeded => WireError::new(
            ErrorCode::LineTooLong,
            format!("the line is longer than the limit of {MAX_LINE_BYTES} bytes"),
        )
        .about("line"),
        LinesCodecError::Io(error) => WireError::new(ErrorCode::BadJson, format!("the line cannot be read: {error}")),
    }
}
