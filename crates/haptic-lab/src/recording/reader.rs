//! Reads a recording, to its end or to where it was broken off.

use super::{Mark, Metadata, TITLE, VERSION};
use csv::StringRecord;
use haptic_ipc::{FIRST_SAMPLE_COLUMNS, SAMPLE_COLUMNS, Sample};
use serde::Deserialize;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Longest line taken, bytes: a file that is no recording is not read into memory whole.
const LONGEST_LINE: u64 = 1 << 20;

/// Why a recording cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It cannot be read further.
    #[error("line {line}: {source}")]
    Read {
        /// Line, from 1.
        line: u64,
        /// What the system said.
        source: io::Error,
    },
    /// It is something else.
    #[error("not a recording: it begins with `{found}`, and a recording with `{TITLE}{VERSION}`")]
    NotARecording {
        /// How it begins.
        found: String,
    },
    /// It was written by a later release.
    #[error("a recording of version {found}; this program reads version {VERSION}")]
    Version {
        /// Its version.
        found: String,
    },
    /// It was broken off before its first row.
    #[error("line {line}: the recording was broken off before its first row")]
    NoRows {
        /// Line, from 1, that is not there.
        line: u64,
    },
    /// Its metadata are missing or cannot be read.
    #[error("line {line}: the metadata cannot be read: {reason}")]
    Metadata {
        /// Line, from 1.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// A column is missing.
    #[error("line {line}: column {place} is to be `{column}`, and is `{found}`")]
    Column {
        /// Line, from 1.
        line: u64,
        /// Place of the column, from 1.
        place: usize,
        /// The column.
        column: &'static str,
        /// What stands there.
        found: String,
    },
    /// A row cannot be read.
    #[error("line {line}: `{found}` is no row: {reason}")]
    Row {
        /// Line, from 1.
        line: u64,
        /// What stands there.
        found: String,
        /// What is wrong.
        reason: String,
    },
    /// A mark cannot be read.
    #[error("line {line}: `{found}` is no mark: {reason}")]
    Mark {
        /// Line, from 1.
        line: u64,
        /// What stands there.
        found: String,
        /// What is wrong.
        reason: String,
    },
    /// A line is longer than any of a recording.
    #[error("line {line} is longer than {LONGEST_LINE} bytes: the file is damaged")]
    LineTooLong {
        /// Line, from 1.
        line: u64,
    },
}

/// How a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// As whoever made it wanted.
    Complete,
    /// Without an end: it is still being written, or its writer died between two lines.
    Open,
    /// In the middle of a line, which was left out.
    BrokenOff {
        /// The line, from 1.
        line: u64,
        /// Bytes of it that are there.
        bytes: usize,
    },
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Complete => f.write_str("complete"),
            Self::Open => f.write_str("without an end: it is still being written, or was broken off between two lines"),
            Self::BrokenOff { line, bytes } => write!(
                f,
                "broken off in line {line}, whose {bytes} bytes were left out; every row before it is there"
            ),
        }
    }
}

/// A row or a mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A sample.
    Row(Sample),
    /// What happened before the next row.
    Mark(Mark),
}

/// A recording, read as it is needed: an iterator over its entries.
#[derive(Debug)]
pub struct Reader<R> {
    /// Columns of its heading.
    columns: usize,
    input: R,
    metadata: Metadata,
    line: u64,
    text: Vec<u8>,
    ending: Option<Ending>,
}

impl<R: BufRead> Reader<R> {
    /// Reads what comes before the first row.
    ///
    /// # Errors
    /// It is no recording, of another version, or broken off before its first row.
    pub fn new(mut input: R) -> Result<Self, RecordingError> {
        let (mut line, mut text) = (0, Vec::new());
        let mut next = |text: &mut Vec<u8>| -> Result<(u64, String), RecordingError> {
            match next_line(&mut input, &mut line, text)? {
                Line::Whole => Ok((line, String::from_utf8_lossy(trimmed(text)).into_owned())),
                // A file of another kind may have no newline at all.
                Line::Partial if line == 1 && !text.starts_with(TITLE.as_bytes()) => Ok((line, shown(text))),
                Line::Partial | Line::None => Err(RecordingError::NoRows { line }),
            }
        };
        let (_, title) = next(&mut text)?;
        match title.strip_prefix(TITLE) {
            None => {
                return Err(RecordingError::NotARecording {
                    found: shown(title.as_bytes()),
                });
            }
            Some(version) if version != VERSION.to_string() => {
                return Err(RecordingError::Version {
                    found: version.to_owned(),
                });
            }
            Some(_) => {}
        }
        // Metadata may be spread over several objects.
        let mut fields = serde_json::Map::new();
        let (at, header) = loop {
            let (at, read) = next(&mut text)?;
            let Some(remark) = read.strip_prefix('#') else {
                break (at, read);
            };
            if remark.trim_start().starts_with('{') {
                let object: serde_json::Map<_, _> =
                    serde_json::from_str(remark).map_err(|error| RecordingError::Metadata {
                        line: at,
                        reason: error.to_string(),
                    })?;
                fields.extend(object);
            }
        };
        let metadata =
            Metadata::deserialize(serde_json::Value::Object(fields)).map_err(|error| RecordingError::Metadata {
                line: at,
                reason: error.to_string(),
            })?;
        let mut found = header.split(',');
        for (index, column) in SAMPLE_COLUMNS.iter().enumerate() {
            let Some(name) = found.next().map(str::trim) else {
                if index >= FIRST_SAMPLE_COLUMNS {
                    // An earlier version wrote it.
                    break;
                }
                return Err(RecordingError::Column {
                    line: at,
                    place: index + 1,
                    column,
                    found: String::new(),
                });
            };
            if name != *column {
                return Err(RecordingError::Column {
                    line: at,
                    place: index + 1,
                    column,
                    found: shown(name.as_bytes()),
                });
            }
        }
        Ok(Self {
            columns: header.split(',').count(),
            input,
            metadata,
            line,
            text,
            ending: None,
        })
    }

    /// Under which circumstances it was made.
    pub const fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// How it ends, once everything has been read.
    pub const fn ending(&self) -> Option<Ending> {
        self.ending
    }

    fn entry(&mut self) -> Result<Option<Entry>, RecordingError> {
        while self.ending.is_none() {
            match next_line(&mut self.input, &mut self.line, &mut self.text)? {
                Line::None => self.ending = Some(Ending::Open),
                Line::Partial => {
                    self.ending = Some(Ending::BrokenOff {
                        line: self.line,
                        bytes: self.text.len(),
                    });
                }
                Line::Whole => {
                    let entry = parse(self.line, trimmed(&self.text), self.columns)?;
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

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let entry = self.entry();
        if entry.is_err() {
            // What follows a line that cannot be read is not trusted.
            self.ending = Some(Ending::Open);
        }
        entry.transpose()
    }
}

/// A whole recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Under which circumstances it was made.
    pub metadata: Metadata,
    /// The samples, oldest first.
    pub rows: Vec<Sample>,
    /// What happened, each with the number of rows before it.
    pub marks: Vec<(usize, Mark)>,
    /// How it ends.
    pub ending: Ending,
}

/// Reads a recording into memory; an hour at 1 kHz takes 400 MB.
///
/// # Errors
/// The file is no recording, or is damaged elsewhere than at its end; the error names the line.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    let file = File::open(path).map_err(|source| RecordingError::Open {
        path: path.to_path_buf(),
        source,
    })?;
    Reader::new(BufReader::new(file))?.into_recording()
}

impl<R: BufRead> Reader<R> {
    /// Reads the rest into memory.
    ///
    /// # Errors
    /// A line is damaged; the error names it.
    pub fn into_recording(mut self) -> Result<Recording, RecordingError> {
        let (mut rows, mut marks) = (Vec::new(), Vec::new());
        while let Some(entry) = self.next().transpose()? {
            match entry {
                Entry::Row(row) => rows.push(row),
                Entry::Mark(mark) => marks.push((rows.len(), mark)),
            }
        }
        Ok(Recording {
            metadata: self.metadata,
            rows,
            marks,
            ending: self.ending.unwrap_or(Ending::Open),
        })
    }
}

enum Line {
    Whole,
    Partial,
    None,
}

fn next_line<R: BufRead>(input: &mut R, line: &mut u64, text: &mut Vec<u8>) -> Result<Line, RecordingError> {
    text.clear();
    *line += 1;
    let read = input
        .by_ref()
        .take(LONGEST_LINE)
        .read_until(b'\n', text)
        .map_err(|source| RecordingError::Read { line: *line, source })?;
    Ok(match text.last() {
        Some(b'\n') => Line::Whole,
        None => Line::None,
        Some(_) if read as u64 == LONGEST_LINE => return Err(RecordingError::LineTooLong { line: *line }),
        Some(_) => Line::Partial,
    })
}

/// Nothing where the line is empty or a remark.
fn parse(line: u64, text: &[u8], columns: usize) -> Result<Option<Entry>, RecordingError> {
    let row_error = |reason: String| RecordingError::Row {
        line,
        found: shown(text),
        reason,
    };
    if let Some(remark) = text.strip_prefix(b"#") {
        return parse_mark(remark).map_err(|error| RecordingError::Mark {
            line,
            found: shown(text),
            reason: error.to_string(),
        });
    }
    if text.is_empty() {
        return Ok(None);
    }
    let cells = std::str::from_utf8(text).map_err(|error| row_error(error.to_string()))?;
    let record = StringRecord::from(cells.split(',').map(str::trim).collect::<Vec<_>>());
    if record.len() < columns {
        return Err(row_error(format!("{} cells of {columns}", record.len())));
    }
    record
        .deserialize(None)
        .map(|row| Some(Entry::Row(row)))
        .map_err(|error| row_error(error.to_string()))
}

/// Marks that a later version may have are remarks to this one.
fn parse_mark(remark: &[u8]) -> Result<Option<Entry>, serde_json::Error> {
    #[derive(Deserialize)]
    struct Kind {
        mark: Option<String>,
    }
    let remark = remark.trim_ascii();
    if !remark.starts_with(b"{") {
        return Ok(None);
    }
    let kind: Kind = serde_json::from_slice(remark)?;
    match kind.mark.as_deref() {
        Some("scene" | "state" | "lost" | "end") => serde_json::from_slice(remark).map(|mark| Some(Entry::Mark(mark))),
        _ => Ok(None),
    }
}

fn trimmed(text: &[u8]) -> &[u8] {
    text.trim_ascii_end()
}

/// The beginning of a line, for messages.
fn shown(text: &[u8]) -> String {
    const LONGEST: usize = 60;
    let text = String::from_utf8_lossy(text);
    let mut shown: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().count() > LONGEST {
        shown.push_str("...");
    }
    shown
}
