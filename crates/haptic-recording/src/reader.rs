//! Reads a recording of any format.

use crate::error::{Ending, Place, RecordingError};
use crate::format::Format;
use crate::mark::{Entry, Mark};
use crate::metadata::Metadata;
use crate::{csv, mcap, parquet};
use bytes::Bytes;
use haptic_ipc::{Sample, SampleY};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that distinguish the formats.
const FIRST_BYTES: u64 = 8;

/// Bytes read at once.
const BUFFER: usize = 1 << 16;

/// A recording, read as it is needed: an iterator over its entries.
pub struct Reader {
    format: Format,
    source: Box<dyn Source>,
    /// An entry could not be read.
    failed: bool,
    /// Whether what follows such an entry is read.
    is_tolerant: bool,
    /// Bytes of a file that are read, and those that it had when it was opened. Parquet counts rows.
    bytes: Option<(Arc<AtomicU64>, u64)>,
}

/// A file that counts what is read of it.
struct CountingFile {
    file: File,
    read: Arc<AtomicU64>,
}

impl Read for CountingFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.read
            .fetch_add(u64::try_from(count).unwrap_or(0), Ordering::Relaxed);
        Ok(count)
    }
}

/// What reads one format.
pub(crate) trait Source: Send {
    /// As [`Reader::metadata`].
    fn metadata(&self) -> &Metadata;

    /// As [`Reader::ending`].
    fn ending(&self) -> Option<Ending>;

    /// The next row or mark; nothing at its end. After an error reading continues behind what is damaged.
    fn entry(&mut self) -> Result<Option<Entry>, RecordingError>;

    /// Bytes that could not be read, so far; 0 where it is not known.
    fn dropped(&self) -> u64 {
        0
    }

    /// Rows that were handed out, and those that there are, where that is known from the beginning.
    fn rows_read(&self) -> Option<(u64, u64)> {
        None
    }
}

/// Opens a recording of one axis; else as [`open_any`].
///
/// # Errors
/// As [`open_any`], and where it has two axes.
pub fn open(path: &Path) -> Result<Reader, RecordingError> {
    let reader = open_any(path)?;
    if reader.metadata().axes == 2 {
        return Err(RecordingError::TwoAxes);
    }
    Ok(reader)
}

/// Opens a recording of one axis or two; its first bytes say which format it has. In the place of a Parquet file
/// that is being made, or was broken off, it opens what there is of it beside.
///
/// # Errors
/// The file cannot be opened, is not a recording, or was broken off before its metadata.
pub fn open_any(path: &Path) -> Result<Reader, RecordingError> {
    let path = &haptic_motion::file_of(path);
    let failed = |source| RecordingError::Open {
        path: path.to_path_buf(),
        source,
    };
    let mut file = File::open(path).map_err(failed)?;
    let mut first = Vec::new();
    file.by_ref()
        .take(FIRST_BYTES)
        .read_to_end(&mut first)
        .map_err(failed)?;
    if first.starts_with(parquet::MAGIC) {
        return Ok(Reader::of(Format::Parquet, parquet::Reader::new(file)?));
    }
    let length = file.metadata().map_err(failed)?.len();
    let read = Arc::new(AtomicU64::new(0));
    let counted = CountingFile {
        file,
        read: Arc::clone(&read),
    };
    let mut reader = Reader::new(first, Box::new(BufReader::with_capacity(BUFFER, counted)))?;
    // A pipe has no length.
    reader.bytes = (length > 0).then_some((read, length));
    Ok(reader)
}

/// Reads a recording of one axis into memory; an hour at 1 kHz takes 500 MB.
///
/// # Errors
/// The file is not a recording, has two axes, or is damaged elsewhere than at its end; the error says where.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    open(path)?.into_recording()
}

impl Reader {
    /// Reads a recording that is in memory.
    ///
    /// # Errors
    /// The bytes are not a recording, or were broken off before its metadata.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, RecordingError> {
        if bytes.starts_with(parquet::MAGIC) {
            return Ok(Self::of(Format::Parquet, parquet::Reader::new(Bytes::from(bytes))?));
        }
        let mut input = Cursor::new(bytes);
        let mut first = Vec::new();
        let read = input.by_ref().take(FIRST_BYTES).read_to_end(&mut first);
        read.map_err(|source| RecordingError::Read {
            place: Place::Byte(0),
            source,
        })?;
        Self::new(first, Box::new(input))
    }

    /// Reads what begins with `first` and continues with `input`.
    fn new(first: Vec<u8>, input: Box<dyn BufRead + Send>) -> Result<Self, RecordingError> {
        if first == ::mcap::MAGIC {
            return Ok(Self::of(Format::Mcap, mcap::Reader::new(input)?));
        }
        let whole: Box<dyn BufRead + Send> = Box::new(Cursor::new(first).chain(input));
        Ok(Self::of(Format::Csv, csv::Reader::new(whole)?))
    }

    fn of(format: Format, source: impl Source + 'static) -> Self {
        Self {
            format,
            source: Box::new(source),
            failed: false,
            is_tolerant: false,
            bytes: None,
        }
    }

    /// Under which circumstances it was made.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        self.source.metadata()
    }

    /// Its format.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// The share of it that is read, from 0 to 1: of the bytes of a file, or of the rows of Parquet. `None` where it is
    /// not known how much there is.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        let (read, all) = match (self.source.rows_read(), &self.bytes) {
            (Some(rows), _) => rows,
            (None, Some((read, all))) => (read.load(Ordering::Relaxed), *all),
            (None, None) => return None,
        };
        #[expect(clippy::cast_precision_loss, reason = "a share of what fits on a disk")]
        let share = read as f64 / all.max(1) as f64;
        // A file that is being written grows meanwhile.
        Some(share.min(1.0))
    }

    /// How it ends, once everything has been read.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        if self.failed {
            // What follows an entry that cannot be read is not trusted.
            return Some(Ending::Open);
        }
        self.source.ending()
    }

    /// From here on skips what cannot be read.
    pub(crate) fn tolerate(&mut self) {
        self.is_tolerant = true;
    }

    /// Bytes that could not be read so far; of Parquet it is not known.
    pub(crate) fn dropped(&self) -> u64 {
        let torn = match self.ending() {
            Some(Ending::BrokenOff { bytes, .. }) => bytes,
            _ => 0,
        };
        torn + self.source.dropped()
    }

    /// Reads the rest into memory.
    ///
    /// # Errors
    /// An entry is damaged; the error says where.
    pub fn into_recording(mut self) -> Result<Recording, RecordingError> {
        let (mut rows, mut rows_y, mut marks) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(entry) = self.next().transpose()? {
            match entry {
                Entry::Row(row, y) => {
                    rows.push(row);
                    rows_y.extend(y);
                }
                Entry::Mark(mark) => marks.push((rows.len(), mark)),
            }
        }
        Ok(Recording {
            metadata: self.metadata().clone(),
            rows,
            rows_y,
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
        let entry = self.source.entry();
        self.failed = entry.as_ref().is_err_and(|error| {
            let is_over = matches!(error, RecordingError::Read { .. } | RecordingError::Open { .. });
            is_over || !self.is_tolerant
        });
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
    /// What each of them has of a second axis; none on a rig of one.
    pub rows_y: Vec<SampleY>,
    /// What happened, each with the number of rows before it.
    pub marks: Vec<(usize, Mark)>,
    /// How it ends.
    pub ending: Ending,
}
