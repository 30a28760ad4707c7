//! Reads MCAP, to its end or to where it was broken off.

use super::layout::{Layout, bytes_at};
use super::records::{self, Next, RECORD_HEADER, Records, damaged};
use super::{MARKS, MESSAGE_HEADER, METADATA, SAMPLES};
use crate::error::{Ending, Place, RecordingError};
use crate::mark::{Entry, Mark};
use crate::metadata::{Metadata, from_fields};
use crate::reader::Source;
use mcap::records::op;
use std::collections::BTreeMap;
use std::io::Read;

/// Start, end, size and checksum: what a chunk begins with.
const CHUNK_HEADER: usize = 8 + 8 + 8 + 4;

/// An MCAP recording, read chunk by chunk.
pub(crate) struct Reader<R> {
    records: Records<R>,
    metadata: Metadata,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    chunk: Chunk,
    ending: Option<Ending>,
    /// How it ends once the chunk has been read.
    pending: Option<Ending>,
    /// Bytes that could not be read, so far.
    dropped: u64,
}

enum Channel {
    Samples(Layout),
    Marks,
    Other,
}

/// Records that are still to be read from a chunk, or a single one that is in none.
#[derive(Default)]
struct Chunk {
    data: Vec<u8>,
    at: usize,
    /// Distance of the data from the file's beginning, bytes.
    place: u64,
}

impl<R: Read> Reader<R> {
    /// Reads up to the metadata. The magic bytes have been read already.
    ///
    /// # Errors
    /// It is not a recording of hapticd, is of another version, or was broken off before its metadata.
    pub(crate) fn new(input: R) -> Result<Self, RecordingError> {
        let mut records = Records::new(input, mcap::MAGIC.len() as u64);
        let metadata = loop {
            let (opcode, place) = match records.next(|opcode| opcode == op::METADATA)? {
                Next::Record { opcode, place } => (opcode, Place::Byte(place)),
                Next::Torn { place, .. } => return Err(RecordingError::no_rows(Place::Byte(place))),
                Next::End => return Err(RecordingError::no_rows(Place::Byte(records.at()))),
            };
            match opcode {
                op::METADATA => {
                    let failed = || RecordingError::metadata(place, "the record is damaged");
                    let (name, rest) = records::text(records.body()).ok_or_else(failed)?;
                    if name == METADATA {
                        let fields = records::map(rest).ok_or_else(failed)?;
                        break from_fields(place, fields)?;
                    }
                }
                op::CHUNK | op::MESSAGE | op::DATA_END | op::FOOTER => {
                    return Err(RecordingError::OtherProgram {
                        format: "MCAP",
                        lacking: format!("the record `{METADATA}` before its messages"),
                    });
                }
                _ => {}
            }
        };
        Ok(Self {
            records,
            metadata,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            chunk: Chunk::default(),
            ending: None,
            pending: None,
            dropped: 0,
        })
    }
}

impl<R: Read + Send> Source for Reader<R> {
    fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    fn ending(&self) -> Option<Ending> {
        self.ending
    }

    fn dropped(&self) -> u64 {
        self.dropped
    }

    fn entry(&mut self) -> Result<Option<Entry>, RecordingError> {
        while self.ending.is_none() {
            if let Some(entry) = self.entry_of_chunk()? {
                if matches!(entry, Entry::Mark(Mark::End { .. })) {
                    self.ending = Some(Ending::Complete);
                }
                return Ok(Some(entry));
            }
            self.ending = self.pending.take();
            if self.ending.is_none() {
                self.next_chunk()?;
            }
        }
        Ok(None)
    }
}

impl<R: Read> Reader<R> {
    /// Goes to the next record that has entries, or to the end.
    fn next_chunk(&mut self) -> Result<(), RecordingError> {
        let place = self.records.at();
        let wanted = |opcode| matches!(opcode, op::CHUNK | op::SCHEMA | op::CHANNEL | op::MESSAGE);
        let next = self.records.next(wanted).inspect_err(|_| {
            // Where the next record begins is not known.
            self.ending = Some(Ending::Open);
        });
        let (opcode, place, is_whole) = match next {
            Ok(Next::Record { opcode, place }) if !matches!(opcode, op::DATA_END | op::FOOTER) => (opcode, place, true),
            Ok(Next::Record { .. } | Next::End) => {
                self.pending = Some(Ending::Open);
                return Ok(());
            }
            Ok(Next::Torn { opcode, place, bytes }) => {
                self.pending = Some(Ending::BrokenOff {
                    place: Place::Byte(place),
                    bytes,
                });
                (opcode, place, false)
            }
            Err(error) => {
                self.dropped += self.records.at() - place + self.records.rest().unwrap_or_default();
                return Err(error);
            }
        };
        let body = self.records.body();
        match opcode {
            op::CHUNK => {
                let place = place + RECORD_HEADER as u64;
                let records = match chunk(body, is_whole) {
                    Ok(records) => records,
                    // The header itself is torn.
                    Err(_) if !is_whole => return Ok(()),
                    Err(reason) => {
                        self.dropped += (RECORD_HEADER + body.len()) as u64;
                        return Err(damaged(place - RECORD_HEADER as u64, reason));
                    }
                };
                self.chunk
                    .set(place + (body.len() - records.len()) as u64, &[], records);
            }
            op::SCHEMA | op::CHANNEL | op::MESSAGE if is_whole => {
                let mut header = [opcode; RECORD_HEADER];
                header[1..].copy_from_slice(&(body.len() as u64).to_le_bytes());
                self.chunk.set(place, &header, body);
            }
            _ => {}
        }
        Ok(())
    }

    /// The next row or mark of the chunk.
    fn entry_of_chunk(&mut self) -> Result<Option<Entry>, RecordingError> {
        loop {
            let (place, rest) = (
                self.chunk.place + self.chunk.at as u64,
                &self.chunk.data[self.chunk.at..],
            );
            let Some((opcode, body)) = record(rest) else {
                self.chunk.at = self.chunk.data.len();
                let bytes = rest.len() as u64;
                if bytes == 0 {
                    return Ok(None);
                }
                let Some(Ending::BrokenOff { .. }) = self.pending else {
                    self.dropped += bytes;
                    return Err(damaged(place, "a record is longer than its chunk"));
                };
                let place = Place::Byte(place);
                self.pending = Some(Ending::BrokenOff { place, bytes });
                return Ok(None);
            };
            self.chunk.at += RECORD_HEADER + body.len();
            let entry = match opcode {
                op::SCHEMA => schema(body)
                    .map(|(id, schema)| {
                        self.schemas.insert(id, schema.to_owned());
                        None
                    })
                    .ok_or_else(|| damaged(place, "a schema is damaged")),
                op::CHANNEL => channel(&self.schemas, body, self.metadata.axes)
                    .map(|(id, channel)| {
                        self.channels.insert(id, channel);
                        None
                    })
                    .map_err(|reason| damaged(place, reason)),
                op::MESSAGE => message(&self.channels, place, body),
                _ => Ok(None),
            };
            match entry {
                Ok(None) => {}
                Ok(entry) => return Ok(entry),
                Err(error) => {
                    self.dropped += (RECORD_HEADER + body.len()) as u64;
                    return Err(error);
                }
            }
        }
    }
}

/// Opcode and body of the first record; `None` if it is incomplete.
fn record(data: &[u8]) -> Option<(u8, &[u8])> {
    let (header, rest) = data.split_at_checked(RECORD_HEADER)?;
    let length = u64::from_le_bytes(bytes_at(header, 1));
    Some((header[0], rest.get(..length.try_into().ok()?)?))
}

impl Chunk {
    /// Takes records, and the place of the first one.
    fn set(&mut self, place: u64, header: &[u8], records: &[u8]) {
        self.data.clear();
        self.data.extend_from_slice(header);
        self.data.extend_from_slice(records);
        (self.at, self.place) = (0, place);
    }
}

/// The records of a chunk; of a torn one those that are there.
fn chunk(body: &[u8], is_whole: bool) -> Result<&[u8], String> {
    const SHORT: &str = "a chunk is too short";
    let (header, rest) = body.split_at_checked(CHUNK_HEADER).ok_or(SHORT)?;
    let (compression, rest) = records::text(rest).ok_or(SHORT)?;
    if !compression.is_empty() {
        return Err(format!(
            "a chunk is compressed with {compression}, which hapticd never does: `mcap decompress` undoes it"
        ));
    }
    let (length, records) = rest.split_first_chunk().ok_or(SHORT)?;
    if !is_whole {
        return Ok(records);
    }
    if u64::from_le_bytes(*length) != records.len() as u64 {
        return Err("a chunk is not as long as it says".to_owned());
    }
    let checksum = u32::from_le_bytes(bytes_at(header, CHUNK_HEADER - 4));
    if checksum != 0 && checksum != crc32fast::hash(records) {
        return Err(format!("the checksum of a chunk of {} bytes is wrong", records.len()));
    }
    Ok(records)
}

/// A schema's number, and its text if it has one.
fn schema(body: &[u8]) -> Option<(u16, &str)> {
    let (id, rest) = body.split_first_chunk()?;
    let (_, rest) = records::text(rest)?;
    let (_, rest) = records::text(rest)?;
    let (data, _) = records::bytes(rest)?;
    Some((u16::from_le_bytes(*id), std::str::from_utf8(data).unwrap_or_default()))
}

fn channel(schemas: &BTreeMap<u16, String>, body: &[u8], axes: u8) -> Result<(u16, Channel), String> {
    let read = || {
        let (id, rest) = body.split_first_chunk()?;
        let (schema, rest) = rest.split_first_chunk()?;
        let (topic, rest) = records::text(rest)?;
        let (encoding, _) = records::text(rest)?;
        Some((u16::from_le_bytes(*id), u16::from_le_bytes(*schema), topic, encoding))
    };
    let (id, schema, topic, encoding) = read().ok_or("a channel is damaged")?;
    let channel = match (topic, encoding) {
        (SAMPLES, "cdr") => {
            let schema = schemas
                .get(&schema)
                .ok_or_else(|| format!("channel {SAMPLES} has no schema"))?;
            let layout = Layout::parse(schema, axes);
            Channel::Samples(layout.map_err(|reason| format!("channel {SAMPLES}: {reason}"))?)
        }
        (MARKS, "json") => Channel::Marks,
        _ => Channel::Other,
    };
    Ok((id, channel))
}

fn message(channels: &BTreeMap<u16, Channel>, place: u64, body: &[u8]) -> Result<Option<Entry>, RecordingError> {
    let (header, data) = body
        .split_at_checked(MESSAGE_HEADER)
        .ok_or_else(|| damaged(place, "a message is too short"))?;
    match channels.get(&u16::from_le_bytes(bytes_at(header, 0))) {
        Some(Channel::Samples(layout)) => match layout.decode(data) {
            Ok((row, y)) => Ok(Some(Entry::Row(row, y))),
            Err(reason) => Err(RecordingError::not_a("row", Place::Byte(place), data, reason)),
        },
        Some(Channel::Marks) => match Mark::from_json(data) {
            Ok(mark) => Ok(mark.map(Entry::Mark)),
            Err(error) => Err(RecordingError::not_a("mark", Place::Byte(place), data, error)),
        },
        Some(Channel::Other) => Ok(None),
        None => Err(damaged(place, "a message has no channel")),
    }
}
