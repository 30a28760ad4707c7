//! The greeting of a controller: every question waits for its answer. The keeper does this, which
//! may wait.

use super::text::Lines;
use device_io::link::{ConnectError, SerialLine};
use device_io::now_ns;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest wait for an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// Most questions without an answer: boards that are reset by the opening of their port need a
/// second or two.
pub(crate) const ATTEMPTS: u32 = 10;

/// A line on which every question waits for its answer.
#[derive(Debug)]
pub(crate) struct Greeting {
    pub(crate) line: SerialLine,
    lines: Lines,
    what: String,
    received_bytes: usize,
}

impl Greeting {
    /// Opens the line, at a rate in baud.
    pub(crate) fn begin(path: &Path, baud: u32) -> Result<Self, ConnectError> {
        Ok(Self {
            line: SerialLine::open(path, baud)?,
            lines: Lines::default(),
            what: path.display().to_string(),
            received_bytes: 0,
        })
    }

    /// Asks until the controller answers. `unanswered` says what a number of bytes without
    /// an answer means.
    pub(crate) fn wake<T>(
        &mut self,
        mut ask: impl FnMut(&mut Self) -> Result<Option<T>, ConnectError>,
        unanswered: impl FnOnce(usize) -> String,
    ) -> Result<T, ConnectError> {
        for _ in 0..ATTEMPTS {
            if let Some(answer) = ask(self)? {
                return Ok(answer);
            }
        }
        Err(self.protocol(unanswered(self.received_bytes)))
    }

    /// Sends text.
    pub(crate) fn send(&mut self, text: &[u8]) -> Result<(), ConnectError> {
        self.line.write(text, now_ns()).map(drop).map_err(|_| self.absent())
    }

    /// The first line that is `wanted`, among those that come in time.
    pub(crate) fn receive<T>(&mut self, mut wanted: impl FnMut(&[u8]) -> Option<T>) -> Result<Option<T>, ConnectError> {
        let began = Instant::now();
        let mut found = None;
        while found.is_none() && began.elapsed() < ANSWER_TIMEOUT {
            self.line.wait(20_000_000);
            let Self {
                line,
                lines,
                received_bytes,
                ..
            } = self;
            let read = line.read(|bytes| {
                *received_bytes += bytes.len();
                lines.take(bytes, |line| {
                    if let (None, Ok(line)) = (&found, line) {
                        found = wanted(line);
                    }
                });
            });
            read.map_err(|_| self.absent())?;
        }
        Ok(found)
    }

    fn absent(&self) -> ConnectError {
        ConnectError::Absent {
            what: self.what.clone(),
        }
    }

    pub(crate) fn protocol(&self, problem: String) -> ConnectError {
        ConnectError::Protocol {
            what: self.what.clone(),
            problem,
        }
    }

    pub(crate) fn refused(&self, why: &str, remedy: &str) -> ConnectError {
        ConnectError::Refused {
            what: self.what.clone(),
            why: why.to_owned(),
            remedy: remedy.to_owned(),
        }
    }
}
