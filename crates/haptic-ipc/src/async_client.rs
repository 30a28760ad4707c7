//! A client for programs that wait for other things too, on tokio.

use crate::client::{ClientError, greeting};
use crate::envelope::Envelope;
use crate::event::Event;
use crate::line::{Hello, ServerLine};
use crate::request::Request;
use serde::de::DeserializeOwned;
use std::collections::VecDeque;
use std::path::Path;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};

/// The daemon's lines.
#[derive(Debug)]
struct Lines {
    reader: BufReader<OwnedReadHalf>,
    line: Vec<u8>,
}

impl Lines {
    /// Reads a line. Safe to drop half-way: the part read is kept for the next call.
    async fn receive(&mut self) -> Result<ServerLine, ClientError> {
        self.reader.read_until(b'\n', &mut self.line).await?;
        if self.line.last() != Some(&b'\n') {
            return Err(ClientError::Closed);
        }
        let parsed = ServerLine::parse(&String::from_utf8_lossy(&self.line));
        self.line.clear();
        Ok(parsed?)
    }
}

/// A connection to the daemon.
#[derive(Debug)]
pub struct AsyncClient {
    hello: Hello,
    lines: Lines,
    writer: OwnedWriteHalf,
    next_id: u64,
    events: VecDeque<Event>,
}

impl AsyncClient {
    /// Connects, and waits for the greeting.
    ///
    /// # Errors
    /// No daemon listens, permission is missing, or the versions differ.
    pub async fn connect(path: &Path) -> Result<Self, ClientError> {
        let (mut lines, writer) = open(path).await?;
        let greeted = lines.receive().await.map_err(|error| error.greeted_at(path))?;
        Ok(Self {
            hello: greeting(greeted)?,
            lines,
            writer,
            next_id: 1,
            events: VecDeque::new(),
        })
    }

    /// Connects and asks at once, before the greeting has come: a daemon without a place for another client hears a
    /// stop all the same, as it is there when the connection is taken.
    ///
    /// # Errors
    /// As [`connect`](Self::connect) and [`request`](Self::request).
    pub async fn ask_at_once<R: DeserializeOwned>(path: &Path, request: Request) -> Result<R, ClientError> {
        let (mut lines, mut writer) = open(path).await?;
        let id = 1;
        send(&mut writer, Envelope { id, request }).await?;
        greeting(lines.receive().await?)?;
        answer(&mut lines, id, drop).await
    }

    /// The greeting of the server.
    #[must_use]
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// Asks, and waits for the answer. Events that come in between are kept for
    /// [`next_event`](Self::next_event).
    ///
    /// # Errors
    /// The request was refused, or the connection failed.
    pub async fn request<R: DeserializeOwned>(&mut self, request: Request) -> Result<R, ClientError> {
        let id = self.next_id;
        self.next_id += 1;
        send(&mut self.writer, Envelope { id, request }).await?;
        answer(&mut self.lines, id, |event| self.events.push_back(event)).await
    }

    /// Waits for the next event. Safe to drop half-way.
    ///
    /// # Errors
    /// The connection failed.
    pub async fn next_event(&mut self) -> Result<Event, ClientError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(event);
        }
        loop {
            if let ServerLine::Event(event) = self.lines.receive().await? {
                return Ok(event);
            }
        }
    }
}

async fn open(path: &Path) -> Result<(Lines, OwnedWriteHalf), ClientError> {
    let stream = UnixStream::connect(path)
        .await
        .map_err(|error| ClientError::connecting(path, error))?;
    let (reader, writer) = stream.into_split();
    let lines = Lines {
        reader: BufReader::new(reader),
        line: Vec::new(),
    };
    Ok((lines, writer))
}

async fn send(writer: &mut OwnedWriteHalf, envelope: Envelope) -> Result<(), ClientError> {
    let mut line = serde_json::to_string(&envelope)?;
    line.push('\n');
    Ok(writer.write_all(line.as_bytes()).await?)
}

/// Waits for the answer to a request; passes on the events that come before it.
async fn answer<R: DeserializeOwned>(
    lines: &mut Lines,
    asked: u64,
    mut each: impl FnMut(Event),
) -> Result<R, ClientError> {
    loop {
        match lines.receive().await? {
            ServerLine::Event(event) => each(event),
            ServerLine::Answer { id, result } if id == Some(asked) => return Ok(serde_json::from_value(result?)?),
            ServerLine::Answer { .. } | ServerLine::Hello(_) => {}
        }
    }
}
