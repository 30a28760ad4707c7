//! Reads CSV, to its end or to where it was broken off.

use super::{TITLE, row};
use crate::columns;
use crate::error::{Ending, OTHER_TABLES, Place, RecordingError, excerpt};
use crate::format::{self, VERSION};
use crate::mark::{Entry, Mark};
use crate::metadata::Metadata;
use crate::reader::Source;
use serde::Deserialize;
use std::io::{BufRead, Read};

/// Longest line accepted, bytes: another kind of file is not read into memory whole.
const MAX_LINE: u64 = 1 << 20;

/// A CSV recording, read as it is needed.
pub(crate) struct Reader<R> {
    /// Columns of its heading.
    columns: usize,
    input: R,
    metadata: Metadata,
    line: u64,
    text: Vec<u8>,
    ending: Option<Ending>,
    /// Bytes of damaged lines, so far.
    dropped: u64,
}

impl<R: BufRead> Reader<R> {
    /// Reads what comes before the first row.
    ///
    /// # Errors
    /// It is not a recording, is of another version, or broken off before its first row.
    pub(crate) fn new(mut input: R) -> Result<Self, RecordingError> {
        let (mut line, mut text) = (0, Vec::new());
        let mut next = |text: &mut Vec<u8>| -> Result<(Place, String), RecordingError> {
            let end = next_line(&mut input, &mut line, text)?;
            let place = Place::Line(line);
            match end {
                LineEnd::Whole => Ok((place, String::from_utf8_lossy(trimmed(text)).into_owned())),
                // A file of another kind may have no newline at all.
                LineEnd::Partial if line == 1 && !text.starts_with(TITLE.as_bytes()) => Ok((place, excerpt(text))),
                LineEnd::Partial | LineEnd::None => Err(RecordingError::no_rows(place)),
            }
        };
        let (_, title) = next(&mut text)?;
        let axes = axes_of(&title)?;
        // Metadata may be spread over several objects.
        let mut fields = serde_json::Map::new();
        let (at, header) = loop {
            let (at, read) = next(&mut text)?;
            let Some(remark) = read.strip_prefix('#') else {
                break (at, read);
            };
            if remark.trim_start().starts_with('{') {
                let object: serde_json::Map<_, _> =
                    serde_json::from_str(remark).map_err(|error| RecordingError::metadata(at, error))?;
                fields.extend(object);
            }
        };
        let metadata = Metadata::deserialize(serde_json::Value::Object(fields))
            .map_err(|error| RecordingError::metadata(at, error))?;
        check_columns(at, &header, axes)?;
        Ok(Self {
            columns: header.split(',').count(),
            input,
            metadata: Metadata { axes, ..metadata },
            line,
            text,
            ending: None,
            dropped: 0,
        })
    }
}

impl<R: BufRead + Send> Source for Reader<R> {
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
            let next = next_line(&mut self.input, &mut self.line, &mut self.text);
            match next.inspect_err(|_| self.dropped += self.text.len() as u64)? {
                LineEnd::None => self.ending = Some(Ending::Open),
                LineEnd::Partial => {
                    self.ending = Some(Ending::BrokenOff {
                        place: Place::Line(self.line),
                        bytes: self.text.len() as u64,
                    });
                }
                LineEnd::Whole => {
                    let entry = parse(self.line, trimmed(&self.text), self.columns, self.metadata.axes)
                        .inspect_err(|_| self.dropped += self.text.len() as u64)?;
                    if matches!(entry, Some(Entry::Mark(Mark::End { .. }))) {
                        self.ending = Some(Ending::Complete);
                    }
                    if entry.is_some() {
                        return Ok(entry);
                    }
                }
            }
        }
        Ok(None)
    }
}

/// The axes of the recording that a first line begins.
fn axes_of(title: &str) -> Result<u8, RecordingError> {
    let version = title.strip_prefix(TITLE).ok_or_else(|| {
        RecordingError::Unknown(format!(
            "not a recording: it begins with `{}`; a recording is MCAP, Parquet, or CSV that begins with \
             `{TITLE}{VERSION}`; {OTHER_TABLES}",
            excerpt(title.as_bytes())
        ))
    })?;
    format::axes(version)
}

/// Whether a header, at a line, names the columns of a recording.
fn check_columns(at: Place, header: &str, axes: u8) -> Result<(), RecordingError> {
    let mut found = header.split(',').map(str::trim);
    for (index, column) in columns::columns(axes).iter().enumerate() {
        let name = found.next();
        if name != Some(column.name) {
            let found = excerpt(name.unwrap_or_default().as_bytes());
            return Err(RecordingError::column(at, index + 1, column.name, &found));
        }
    }
    Ok(())
}

enum LineEnd {
    Whole,
    Partial,
    None,
}

fn next_line<R: BufRead>(input: &mut R, line: &mut u64, text: &mut Vec<u8>) -> Result<LineEnd, RecordingError> {
    text.clear();
    *line += 1;
    let read = input
        .by_ref()
        .take(MAX_LINE)
        .read_until(b'\n', text)
        .map_err(|source| RecordingError::Read {
            place: Place::Line(*line),
            source,
        })?;
    Ok(match text.last() {
        Some(b'\n') => LineEnd::Whole,
        None => LineEnd::None,
        Some(_) if read as u64 == MAX_LINE => {
            let reason = format!("line {line} is longer than {MAX_LINE} bytes: the file is damaged");
            return Err(RecordingError::Damaged(reason));
        }
        Some(_) => LineEnd::Partial,
    })
}

/// `None` for an empty line or a remark.
fn parse(line: u64, text: &[u8], columns: usize, axes: u8) -> Result<Option<Entry>, RecordingError> {
    let place = Place::Line(line);
    if let Some(remark) = text.strip_prefix(b"#") {
        return parse_mark(remark).map_err(|error| RecordingError::not_a("mark", place, text, error));
    }
    if text.is_empty() {
        return Ok(None);
    }
    row::parse(text, columns, axes)
        .map(|(row, y)| Some(Entry::Row(row, y)))
        .map_err(|reason| RecordingError::not_a("row", place, text, reason))
}

fn parse_mark(remark: &[u8]) -> Result<Option<Entry>, serde_json::Error> {
    let remark = remark.trim_ascii();
    if !remark.starts_with(b"{") {
        return Ok(None);
    }
    Ok(Mark::from_json(remark)?.map(Entry::Mark))
}

fn trimmed(text: &[u8]) -> &[u8] {
    text.trim_ascii_end()
}
