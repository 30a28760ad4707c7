//! One client: reads its lines, answers each, and sends it its events.

use crate::control::{RigHandle, advise, describe, drive, get, set, status, subscribe, timing};
use crate::rig_state::Command;
use crate::telemetry::feed::BACKLOG_LINES;
use haptic_ipc::{Envelope, ErrorCode, Hello, MAX_LINE_BYTES, PROTOCOL_VERSION, Request, WireError};
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

/// Talks to one client until it goes.
pub(super) async fn run(rig: Rc<RigHandle>, stream: UnixStream, session: u64) {
    let (mut reader, writer) = stream.into_split();
    let (lines, outgoing) = mpsc::channel(BACKLOG_LINES);
    let writing = tokio::task::spawn_local(write(writer, outgoing));
    let client = Client { rig, lines, session };
    // When the writer gives up on a client that does not read, reading from it ends too.
    tokio::select! {
        () = client.converse(&mut reader) => {}
        () = client.lines.closed() => {}
    }
    client.rig.feed().unsubscribe(session);
    drop(client);
    // What is still queued is written, or given up after the time that every line has.
    drop(writing.await);
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
}

impl Client {
    async fn converse(&self, reader: &mut (impl AsyncReadExt + Unpin)) {
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            server: self.rig.facts.server.clone(),
            session: format!("{}-{}", std::process::id(), self.session),
        };
        if self.say(&json!({ "hello": hello })).await.is_err() {
            return;
        }
        let mut codec = LinesCodec::new_with_max_length(MAX_LINE_BYTES);
        let mut buffer = BytesMut::new();
        loop {
            loop {
                let answered = match codec.decode(&mut buffer) {
                    Ok(None) => break,
                    Ok(Some(line)) if line.trim().is_empty() => Ok(()),
                    Ok(Some(line)) => self.answer(&line).await,
                    Err(error) => self.say(&answer::<()>(None, Err(unreadable(&error)))).await,
                };
                if answered.is_err() {
                    return;
                }
            }
            // A client that hangs up in the middle of a line asked for nothing.
            if !matches!(reader.read_buf(&mut buffer).await, Ok(1..)) {
                return;
            }
        }
    }

    async fn answer(&self, line: &str) -> Result<(), Gone> {
        let envelope = match Envelope::parse(line) {
            Ok(envelope) => envelope,
            Err((id, error)) => return self.say(&answer::<()>(id, Err(error))).await,
        };
        let id = Some(envelope.id);
        let rig = &*self.rig;
        let reply = match envelope.request {
            Request::Describe {} => answer(id, Ok(describe::describe(rig))),
            Request::Get {} => answer(id, Ok(get::get(rig))),
            Request::Set { params } => answer(id, set::set(rig, &params).await),
            Request::Engage {} => answer(id, drive::command(rig, Command::Engage).await),
            Request::Release {} => answer(id, drive::command(rig, Command::Release).await),
            Request::Reset {} => answer(id, drive::command(rig, Command::Reset).await),
            Request::Stop {} => answer(id, drive::stop(rig).await),
            Request::Status {} => answer(id, Ok(status::status(rig))),
            Request::Timing {} => answer(id, Ok(timing::timing(rig))),
            Request::Advise {} => answer(id, Ok(advise::advise(rig))),
            Request::Subscribe {
                topics,
                rate_hz,
                batch_ms,
            } => {
                let reply = subscribe::subscribe(rig, self.session, &self.lines, &topics, rate_hz, batch_ms);
                answer(id, reply)
            }
        };
        self.say(&reply).await
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
