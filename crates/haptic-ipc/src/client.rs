//! A blocking client, in two halves so that one thread can listen while another asks.

use crate::envelope::Envelope;
use crate::error::WireError;
use crate::event::Event;
use crate::line::{Hello, ServerLine};
use crate::request::Request;
use crate::socket_path;
use crate::{MAX_LINE_BYTES, PROTOCOL_VERSION, socket_permission};
use serde::de::DeserializeOwned;
use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// Why a request has failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ClientError {
    /// No daemon listens on the socket.
    #[error("no daemon at {}: {source}; {}", .path.display(), remedy(path))]
    NoDaemon {
        /// The socket.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The socket may not be used.
    #[error("no permission to use {}: {source}; {}", .path.display(), socket_permission::remedy(path))]
    Permission {
        /// The socket.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The server speaks another protocol.
    #[error(
        "{server} speaks protocol {theirs}, this client protocol {PROTOCOL_VERSION}: use programs of the same release"
    )]
    Version {
        /// The server.
        server: String,
        /// Its protocol.
        theirs: u32,
    },
    /// The daemon refused the request.
    #[error("{0}")]
    Refused(#[from] WireError),
    /// The daemon sent a line that is not of the protocol.
    #[error("the daemon's answer cannot be read: {0}")]
    BadAnswer(#[from] serde_json::Error),
    /// The connection ended before the greeting: the service manager ends it so where the daemon cannot start.
    #[error("no daemon greets at {}; {}", .path.display(), remedy(path))]
    NoGreeting {
        /// The socket.
        path: PathBuf,
    },
    /// The connection ended.
    #[error("the daemon closed the connection")]
    Closed,
    /// The connection failed.
    #[error("the connection to the daemon failed: {0}")]
    Io(#[from] io::Error),
}

impl ClientError {
    /// Classifies an error of connecting to `path`.
    #[must_use]
    pub fn connecting(path: &Path, source: io::Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            io::ErrorKind::PermissionDenied => Self::Permission { path, source },
            _ => Self::NoDaemon { path, source },
        }
    }

    /// The same error where the greeting was waited for at `path`.
    pub(crate) fn greeted_at(self, path: &Path) -> Self {
        match self {
            Self::Closed => Self::NoGreeting {
                path: path.to_path_buf(),
            },
            error => error,
        }
    }
}

/// What a user does where no daemon serves a socket.
fn remedy(socket: &Path) -> String {
    let of_path = || match socket_path::is_usual(socket) {
        true => "start one with `hapticd --demo`, or name its socket with --socket or HAPTICD_SOCKET".to_owned(),
        false => format!(
            "check the path, or start one there with `hapticd --demo --socket {}`",
            socket.display()
        ),
    };
    socket_path::remedy(socket).unwrap_or_else(of_path)
}

/// Timeout of the greeting: a daemon greets as soon as it accepts.
const GREETING_TIMEOUT: Duration = Duration::from_secs(5);

/// Checks the greeting.
///
/// # Errors
/// The conversation cannot continue.
pub(crate) fn greeting(line: ServerLine) -> Result<Hello, ClientError> {
    match line {
        ServerLine::Hello(hello) if hello.protocol == PROTOCOL_VERSION => Ok(hello),
        ServerLine::Hello(hello) => Err(ClientError::Version {
            server: hello.server,
            theirs: hello.protocol,
        }),
        // Refused before the greeting: too many clients, or another user's daemon.
        ServerLine::Answer { result: Err(error), .. } => Err(ClientError::Refused(error)),
        _ => Err(ClientError::BadAnswer(serde::de::Error::custom(
            "the daemon did not greet",
        ))),
    }
}

/// The asking half.
#[derive(Debug)]
pub struct Sender {
    stream: UnixStream,
    next_id: u64,
}

impl Sender {
    /// The number of the next request, for callers that need it before the answer can arrive.
    #[must_use]
    pub const fn next_id(&self) -> u64 {
        self.next_id
    }

    /// Sends a request; the answer will carry the number returned.
    ///
    /// # Errors
    /// The connection failed.
    pub fn send(&mut self, request: Request) -> Result<u64, ClientError> {
        let id = self.next_id;
        self.next_id += 1;
        let mut line = serde_json::to_string(&Envelope { id, request })?;
        line.push('\n');
        self.stream.write_all(line.as_bytes())?;
        Ok(id)
    }
}

/// The listening half.
#[derive(Debug)]
pub struct Receiver {
    reader: BufReader<UnixStream>,
    line: Vec<u8>,
}

impl Receiver {
    /// Waits for the next line.
    ///
    /// # Errors
    /// The connection ended, failed or timed out ([`io::ErrorKind::WouldBlock`]), or the line is
    /// not of the protocol. After a time-out the part of a line that was read is kept.
    pub fn receive(&mut self) -> Result<ServerLine, ClientError> {
        // An answer may be longer than a request; only its newline ends it.
        let read = self.reader.read_until(b'\n', &mut self.line)?;
        if self.line.last() != Some(&b'\n') {
            return Err(ClientError::Closed);
        }
        debug_assert!(read > 0);
        let parsed = ServerLine::parse(&String::from_utf8_lossy(&self.line));
        self.line.clear();
        // One long answer must not keep its memory for ever.
        self.line.shrink_to(MAX_LINE_BYTES);
        Ok(parsed?)
    }

    /// Ends the connection for both halves: one that is stuck in sending to a daemon that does not
    /// read gives up.
    pub fn hang_up(&self) {
        // It may be closed already.
        drop(self.reader.get_ref().shutdown(std::net::Shutdown::Both));
    }

    /// How long [`receive`](Self::receive) waits; without a limit it waits for ever.
    ///
    /// # Errors
    /// The system refused the time-out.
    pub fn set_timeout(&mut self, timeout: Option<Duration>) -> Result<(), ClientError> {
        Ok(self.reader.get_ref().set_read_timeout(timeout)?)
    }
}

/// A connection to the daemon.
#[derive(Debug)]
pub struct Client {
    hello: Hello,
    sender: Sender,
    receiver: Receiver,
    events: VecDeque<Event>,
}

impl Client {
    /// Connects, and waits for the greeting.
    ///
    /// # Errors
    /// No daemon listens, permission is missing, the versions differ, or no greeting comes within
    /// five seconds.
    pub fn connect(path: &Path) -> Result<Self, ClientError> {
        let stream = UnixStream::connect(path).map_err(|error| ClientError::connecting(path, error))?;
        let mut receiver = Receiver {
            reader: BufReader::new(stream.try_clone()?),
            line: Vec::new(),
        };
        receiver.set_timeout(Some(GREETING_TIMEOUT))?;
        let hello = greeting(receiver.receive().map_err(|error| error.greeted_at(path))?)?;
        receiver.set_timeout(None)?;
        Ok(Self {
            hello,
            sender: Sender { stream, next_id: 1 },
            receiver,
            events: VecDeque::new(),
        })
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
    pub fn request<R: DeserializeOwned>(&mut self, request: Request) -> Result<R, ClientError> {
        let asked = self.sender.send(request)?;
        loop {
            match self.receiver.receive()? {
                ServerLine::Event(event) => self.events.push_back(event),
                ServerLine::Answer { id, result } if id == Some(asked) => return Ok(serde_json::from_value(result?)?),
                ServerLine::Answer { .. } | ServerLine::Hello(_) => {}
            }
        }
    }

    /// Waits for the next event.
    ///
    /// # Errors
    /// The connection failed.
    pub fn next_event(&mut self) -> Result<Event, ClientError> {
        if let Some(event) = self.events.pop_front() {
            return Ok(event);
        }
        loop {
            if let ServerLine::Event(event) = self.receiver.receive()? {
                return Ok(event);
            }
        }
    }

    /// The two halves, for two threads.
    #[must_use]
    pub fn split(self) -> (Sender, Receiver) {
        (self.sender, self.receiver)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn a_connection_that_ends_without_a_greeting_names_its_socket() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("control.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        // As systemd does where the service cannot start.
        let accepting = std::thread::spawn(move || drop(listener.accept().expect("a client")));
        let error = Client::connect(&path).expect_err("nobody greets");
        accepting.join().expect("it accepts");
        assert!(matches!(&error, ClientError::NoGreeting { .. }), "{error:?}");
        assert!(error.to_string().contains("control.sock"), "{error}");
    }
}
