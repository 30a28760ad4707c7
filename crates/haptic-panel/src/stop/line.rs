//! A connection for stops alone. None of its calls waits.

use haptic_ipc::{ClientError, Envelope, Hello, MAX_LINE_BYTES, Request, Rights, ServerLine, StateReply, WireError};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType};
use std::io::{self, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time limit of the greeting. A running daemon greets within a millisecond.
const GREETING: Duration = Duration::from_secs(1);

/// Time after which a stop counts as not sent. Attempts continue.
pub(super) const UNWRITTEN: Duration = Duration::from_millis(100);

/// Time without an answer after which another connection is tried.
const UNANSWERED: Duration = Duration::from_secs(1);

/// A stop on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub(super) number: u64,
    pub(super) pressed_at: Instant,
}

/// A message of the daemon.
#[derive(Debug)]
pub(super) enum Received {
    /// The daemon has greeted: it takes stops now.
    Greeting { is_for_a_moment: bool, session: String },
    /// The stop was answered.
    Answer(Stop, Result<StateReply, WireError>),
}

/// A connection for stops.
#[derive(Debug)]
pub(super) struct StopLine {
    stream: UnixStream,
    opened_at: Instant,
    is_greeted: bool,
    incoming: Vec<u8>,
    /// The bytes of the newest stop that the socket has not taken.
    outgoing: Vec<u8>,
    /// The newest stop on the line.
    newest: Option<Stop>,
    /// Time at which the first unanswered stop was written.
    unanswered_since: Option<Instant>,
    unanswered: Vec<Stop>,
}

impl StopLine {
    /// Connects. The daemon's greeting comes later.
    pub(super) fn open(path: &Path, now: Instant) -> Result<Self, String> {
        let address = SocketAddrUnix::new(path).map_err(|error| error.to_string())?;
        let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
        let socket = rustix::net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)
            .map_err(|error| error.to_string())?;
        rustix::net::connect(&socket, &address).map_err(|error| match error {
            Errno::NOENT | Errno::CONNREFUSED => "no connection".to_owned(),
            // The daemon's backlog is full.
            Errno::AGAIN => "the daemon does not take connections".to_owned(),
            error => ClientError::connecting(path, error.into()).to_string(),
        })?;
        Ok(Self {
            stream: socket.into(),
            opened_at: now,
            is_greeted: false,
            incoming: Vec::new(),
            outgoing: Vec::new(),
            newest: None,
            unanswered_since: None,
            unanswered: Vec::new(),
        })
    }

    pub(super) fn stream(&self) -> &UnixStream {
        &self.stream
    }

    /// Whether bytes wait for room in the socket.
    pub(super) fn waits_to_write(&self) -> bool {
        !self.outgoing.is_empty()
    }

    /// The newest stop on the line.
    pub(super) fn newest(&self) -> Option<Stop> {
        self.newest
    }

    /// Puts a stop on the line if the daemon has greeted and the stop is new; returns whether it did.
    pub(super) fn enqueue(&mut self, stop: Stop) -> bool {
        let is_new = self.newest.is_none_or(|newest| newest.number < stop.number);
        // A second stop behind an unwritten one is of no use.
        if !self.is_greeted || !is_new || self.waits_to_write() {
            return false;
        }
        let request = Envelope {
            id: stop.number,
            request: Request::Stop {},
        };
        let Ok(text) = serde_json::to_string(&request) else {
            return false;
        };
        self.outgoing = text.into_bytes();
        self.outgoing.push(b'\n');
        self.newest = Some(stop);
        self.unanswered.push(stop);
        true
    }

    /// Writes what the socket takes; returns whether everything is written.
    pub(super) fn write(&mut self, now: Instant) -> Result<bool, String> {
        while self.waits_to_write() {
            match self.stream.write(&self.outgoing) {
                Ok(written) => drop(self.outgoing.drain(..written)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(false),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.to_string()),
            }
        }
        self.unanswered_since.get_or_insert(now);
        Ok(true)
    }

    /// Reads the messages that have arrived.
    pub(super) fn read(&mut self) -> Result<Vec<Received>, String> {
        let mut received = Vec::new();
        let mut chunk = [0; 4096];
        loop {
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err("no connection".to_owned()),
                Ok(count) => self.incoming.extend_from_slice(&chunk[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(received),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.to_string()),
            }
            while let Some(end) = self.incoming.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.incoming.drain(..=end).collect();
                received.extend(self.hear(&String::from_utf8_lossy(&line))?);
            }
            if self.incoming.len() > MAX_LINE_BYTES {
                return Err("what answers there is not a daemon".to_owned());
            }
        }
    }

    fn hear(&mut self, line: &str) -> Result<Option<Received>, String> {
        match ServerLine::parse(line) {
            // At any version: every daemon understands a stop.
            Ok(ServerLine::Hello(Hello { rights, session, .. })) => {
                self.is_greeted = true;
                let is_for_a_moment = rights == Rights::Stop;
                Ok(Some(Received::Greeting {
                    is_for_a_moment,
                    session,
                }))
            }
            Ok(ServerLine::Answer { id: Some(id), result }) => {
                let found = self.unanswered.iter().find(|stop| stop.number == id).copied();
                let Some(stop) = found else { return Ok(None) };
                self.unanswered.retain(|other| other.number > id);
                if self.unanswered.is_empty() {
                    self.unanswered_since = None;
                }
                let reply = result.and_then(|value| {
                    serde_json::from_value(value).map_err(|error| {
                        let message = format!("the daemon's answer to a stop cannot be read: {error}");
                        WireError::new(haptic_ipc::ErrorCode::Unknown, message)
                    })
                });
                Ok(Some(Received::Answer(stop, reply)))
            }
            // The daemon refused the connection.
            Ok(ServerLine::Answer {
                id: None,
                result: Err(error),
            }) => Err(error.message),
            Ok(ServerLine::Answer { .. } | ServerLine::Event(_)) | Err(_) => Ok(None),
        }
    }

    /// Time at which the line is given up unless a message arrives.
    pub(super) fn deadline(&self) -> Option<Instant> {
        if !self.is_greeted {
            return Some(self.opened_at + GREETING);
        }
        self.unanswered_since.map(|since| since + UNANSWERED)
    }

    /// Why the line is given up, if its time is over.
    pub(super) fn expired(&self, now: Instant) -> Option<&'static str> {
        self.deadline().filter(|deadline| *deadline <= now)?;
        Some(if self.is_greeted {
            "the daemon does not answer"
        } else {
            "the daemon does not greet"
        })
    }
}
