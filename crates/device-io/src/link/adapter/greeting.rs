//! Asking a controller who it is: by the keeper, which may wait.

use super::super::clock;
use super::super::keeper::ConnectError;
use super::super::serial::Line;
use super::text::Lines;
use std::path::Path;
use std::time::{Duration, Instant};

/// For an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// For a controller to answer at all: boards that are reset by the opening of their port need a second or two.
pub(super) const ATTEMPTS: u32 = 10;

/// A conversation in which every question waits for its answer.
#[derive(Debug)]
pub(super) struct Greeting {
    pub(super) line: Line,
    lines: Lines,
    what: String,
    heard_bytes: usize,
}

impl Greeting {
    pub(super) fn begin(path: &Path, baud: u32) -> Result<Self, ConnectError> {
        Ok(Self {
            line: Line::open(path, baud)?,
            lines: Lines::default(),
            what: path.display().to_string(),
            heard_bytes: 0,
        })
    }

    /// Sends text.
    pub(super) fn say(&mut self, text: &[u8]) -> Result<(), ConnectError> {
        self.line
            .write(text, clock::now_ns())
            .map(drop)
            .map_err(|_| self.absent())
    }

    /// The first line that is one of those looked for, of those that come in time.
    pub(super) fn hear<T>(&mut self, mut wanted: impl FnMut(&[u8]) -> Option<T>) -> Result<Option<T>, ConnectError> {
        let began = Instant::now();
        let mut found = None;
        while found.is_none() && began.elapsed() < ANSWER_TIMEOUT {
            self.line.wait(20_000_000);
            let Self {
                line,
                lines,
                heard_bytes,
                ..
            } = self;
            let read = line.read(|bytes| {
                *heard_bytes += bytes.len();
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

    /// Whether anything was heard.
    pub(super) fn heard_bytes(&self) -> usize {
        self.heard_bytes
    }

    fn absent(&self) -> ConnectError {
        ConnectError::Absent {
            what: self.what.clone(),
        }
    }

    pub(super) fn protocol(&self, heard: String) -> ConnectError {
        ConnectError::Protocol {
            what: self.what.clone(),
            heard,
        }
    }

    pub(super) fn refused(&self, why: &str, remedy: &str) -> ConnectError {
        ConnectError::Refused {
            what: self.what.clone(),
            why: why.to_owned(),
            remedy: remedy.to_owned(),
        }
    }
}
