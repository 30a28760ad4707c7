//! The records of an MCAP file, one after the other.

use super::layout::bytes_at;
use crate::error::{Place, RecordingError};
use std::fmt::Display;
use std::io::{self, Read};

/// Longest record that is taken into memory, bytes: chunks of other tools have some megabytes.
const MAX_RECORD: u64 = 1 << 26;

/// Opcodes from here on are for private records.
const PRIVATE: u8 = 0x80;

/// Opcode and length of a record.
pub(super) const RECORD_HEADER: usize = 1 + 8;

/// Reads the records of a file.
pub(super) struct Records<R> {
    input: R,
    /// Distance from the file's beginning, bytes.
    at: u64,
    /// The newest record, without opcode and length.
    body: Vec<u8>,
}

/// What comes next.
pub(super) enum Next {
    /// A record, which [`Records::body`] holds if it is of interest.
    Record { opcode: u8, place: u64 },
    /// A record of which `bytes` are there, with opcode and length.
    Torn { opcode: u8, place: u64, bytes: u64 },
    /// Nothing.
    End,
}

impl<R: Read> Records<R> {
    /// Begins behind the magic bytes, `at` bytes from the file's beginning.
    pub(super) fn new(input: R, at: u64) -> Self {
        Self {
            input,
            at,
            body: Vec::new(),
        }
    }

    /// The newest record, without opcode and length.
    pub(super) fn body(&self) -> &[u8] {
        &self.body
    }

    /// Goes to the next record; one that is not `wanted` is passed over.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged here.
    pub(super) fn next(&mut self, wanted: impl Fn(u8) -> bool) -> Result<Next, RecordingError> {
        let place = self.at;
        let failed = |source| RecordingError::Read {
            place: Place::Byte(place),
            source,
        };
        self.body.clear();
        let header = RECORD_HEADER as u64;
        let found = self
            .input
            .by_ref()
            .take(header)
            .read_to_end(&mut self.body)
            .map_err(failed)? as u64;
        self.at += found;
        let opcode = self.body.first().copied().unwrap_or_default();
        if found == 0 {
            return Ok(Next::End);
        }
        if opcode == 0 {
            // A disk that lost power may have left zeros.
            let bytes = found + self.rest().map_err(failed)?;
            return Ok(Next::Torn { opcode, place, bytes });
        }
        if opcode > mcap::records::op::DATA_END && opcode < PRIVATE {
            return Err(damaged(place, format!("no record of MCAP begins with {opcode}")));
        }
        if found < header {
            return Ok(Next::Torn {
                opcode,
                place,
                bytes: found,
            });
        }
        let length = u64::from_le_bytes(bytes_at(&self.body, 1));
        self.body.clear();
        let mut body = self.input.by_ref().take(length);
        let read = if !wanted(opcode) {
            io::copy(&mut body, &mut io::sink())
        } else if length <= MAX_RECORD {
            body.read_to_end(&mut self.body).map(|read| read as u64)
        } else {
            return Err(damaged(place, format!("a record of {length} bytes")));
        };
        let read = read.map_err(failed)?;
        self.at += read;
        Ok(if read < length {
            let bytes = header + read;
            Next::Torn { opcode, place, bytes }
        } else {
            Next::Record { opcode, place }
        })
    }

    /// Distance from the file's beginning, bytes.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// Reads on to the end of the file; returns how many bytes there were.
    pub(super) fn rest(&mut self) -> io::Result<u64> {
        let rest = io::copy(&mut self.input, &mut io::sink())?;
        self.at += rest;
        Ok(rest)
    }
}

/// What holds the rows is damaged.
pub(super) fn damaged(place: u64, reason: impl Display) -> RecordingError {
    RecordingError::at(Place::Byte(place), reason)
}

/// A field of text, behind its length; and what follows.
pub(super) fn text(data: &[u8]) -> Option<(&str, &[u8])> {
    let (text, rest) = bytes(data)?;
    Some((std::str::from_utf8(text).ok()?, rest))
}

/// A field of bytes, behind its length of four bytes; and what follows.
pub(super) fn bytes(data: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = data.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length).try_into().ok()?)
}

/// A map of texts.
pub(super) fn map(data: &[u8]) -> Option<Vec<(&str, &str)>> {
    let (mut data, _) = bytes(data)?;
    let mut map = Vec::new();
    while !data.is_empty() {
        let (name, rest) = text(data)?;
        let (value, rest) = text(rest)?;
        map.push((name, value));
        data = rest;
    }
    Some(map)
}
