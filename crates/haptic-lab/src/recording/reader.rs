//! Reads a recording of any format.

use super::{Ending, Format, Mark, Metadata, Place, RecordingError, csv, mcap};
use haptic_ipc::Sample;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// Bytes by which the formats are told apart.
const FIRST_BYTES: u64 = 8;

/// Bytes read at once.
const BUFFER: usize = 1 << 16;

/// A row or a mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A sample.
    Row(Sample),
    /// What happened before the next row.
    Mark(Mark),
}

/// A recording, read as it is needed: an iterator over its entries.
pub struct Reader {
    source: Source,
    /// An entry could not be read.
    failed: bool,
}

enum Source {
    Csv(Box<csv::Reader<Box<dyn BufRead + Send>>>),
    Mcap(Box<mcap::Reader<Box<dyn BufRead + Send>>>),
}

/// Opens a recording; its first bytes say which format it has.
///
/// # Errors
/// The file cannot be opened, is no recording, or was broken off before its metadata.
pub fn open(path: &Path) -> Result<Reader, RecordingError> {
    let failed = |source| RecordingError::Open {
        path: path.to_path_buf(),
        source,
    };
    Reader::new(Box::new(BufReader::with_capacity(
        BUFFER,
        File::open(path).map_err(failed)?,
    )))
}

/// Reads a recording into memory; an hour at 1 kHz takes 500 MB.
///
/// # Errors
/// The file is no recording, or is damaged elsewhere than at its end; the error says where.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    open(path)?.into_recording()
}

impl Reader {
    /// Reads a recording that is in memory.
    ///
    /// # Errors
    /// The bytes are no recording, or were broken off before its metadata.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, RecordingError> {
        Self::new(Box::new(Cursor::new(bytes)))
    }

    fn new(mut input: Box<dyn BufRead + Send>) -> Result<Self, RecordingError> {
        let mut first = Vec::new();
        input
            .by_ref()
            .take(FIRST_BYTES)
            .read_to_end(&mut first)
            .map_err(|source| RecordingError::Read {
                place: Place::Byte(0),
                source,
            })?;
        let source = if first == ::mcap::MAGIC {
            Source::Mcap(Box::new(mcap::Reader::new(input)?))
        } else {
            let whole: Box<dyn BufRead + Send> = Box::new(Cursor::new(first).chain(input));
            Source::Csv(Box::new(csv::Reader::new(whole)?))
        };
        Ok(Self { source, failed: false })
    }

    /// Under which circumstances it was made.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        match &self.source {
            Source::Csv(csv) => csv.metadata(),
            Source::Mcap(mcap) => mcap.metadata(),
        }
    }

    /// Its format.
    #[must_use]
    pub const fn format(&self) -> Format {
        match self.source {
            Source::Csv(_) => Format::Csv,
            Source::Mcap(_) => Format::Mcap,
        }
    }

    /// How it ends, once everything has been read.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        if self.failed {
            // What follows an entry that cannot be read is not trusted.
            return Some(Ending::Open);
        }
        match &self.source {
            Source::Csv(csv) => csv.ending(),
            Source::Mcap(mcap) => mcap.ending(),
        }
    }

    /// Reads the rest into memory.
    ///
    /// # Errors
    /// An entry is damaged; the error says where.
    pub fn into_recording(mut self) -> Result<Recording, RecordingError> {
        let (mut rows, mut marks) = (Vec::new(), Vec::new());
        while let Some(entry) = self.next().transpose()? {
            match entry {
                Entry::Row(row) => rows.push(row),
                Entry::Mark(mark) => marks.push((rows.len(), mark)),
            }
        }
        Ok(Recording {
            metadata: self.metadata().clone(),
            rows,
            marks,
            ending: self.ending().unwrap_or(Ending::Open),
        })
    }
}

impl Iterator for Reader {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let entry = match &mut self.source {
            Source::Csv(csv) => csv.entry(),
            Source::Mcap(mcap) => mcap.entry(),
        };
        self.failed = entry.is_err();
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
