//! A file by its first bytes. It is opened once: a pipe cannot be wound back.

use crate::guard::guarded;
use crate::table::{ParquetTable, TableError};
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::io::{self, Chain, Cursor, Read};
use std::path::Path;

/// How the keys begin that a recording of hapticd has in its footer.
pub const RECORDING_KEY: &str = "hapticd.";

/// What a recording of hapticd in CSV begins with; its version follows.
pub const RECORDING_TITLE: &str = "# hapticd recording ";

/// The first bytes of a Parquet file.
pub const PARQUET_MAGIC: &[u8] = b"PAR1";

/// What is read of a file to tell what it is, bytes.
const MAGIC_BYTES: u64 = 20;

/// A file whose first bytes have been looked at.
pub(crate) type Input = Chain<Cursor<Vec<u8>>, File>;

/// What an opened file is.
#[expect(missing_debug_implementations, reason = "the library's reader has none")]
pub enum Opened {
    /// A recording of hapticd in CSV.
    CsvRecording(Input),
    /// A recording of hapticd in Parquet, or why the file cannot be read as Parquet.
    ParquetRecording(Result<SerializedFileReader<File>, String>),
    /// MCAP, of hapticd or another program.
    Mcap(Input),
    /// A table of another program in Parquet.
    Parquet(ParquetTable),
    /// Anything else: text, if it is a table.
    Text(Input),
}

impl Opened {
    /// Opens a file.
    ///
    /// # Errors
    /// It cannot be opened or read.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        File::open(path)
            .and_then(|file| Self::new(path, file))
            .map_err(|error| TableError::of(path, error))
    }

    /// The same of a file that the caller has opened; `path` is its name.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn new(path: &Path, mut file: File) -> io::Result<Self> {
        let mut first = Vec::new();
        (&mut file).take(MAGIC_BYTES).read_to_end(&mut first)?;
        if first.starts_with(PARQUET_MAGIC) {
            return Ok(match guarded(|| SerializedFileReader::new(file)) {
                Ok(reader) if !is_recording(&reader) => Self::Parquet(ParquetTable::new(path, reader)),
                opened => Self::ParquetRecording(opened),
            });
        }
        let (is_recording, is_mcap) = (
            first.starts_with(RECORDING_TITLE.as_bytes()),
            first.starts_with(mcap::MAGIC),
        );
        let input = Cursor::new(first).chain(file);
        Ok(match (is_recording, is_mcap) {
            (true, _) => Self::CsvRecording(input),
            (_, true) => Self::Mcap(input),
            _ => Self::Text(input),
        })
    }

    /// Whether it is a recording of hapticd, or MCAP, or damaged Parquet: none that [`Table`](crate::table::Table)
    /// reads unless it is asked to.
    #[must_use]
    pub const fn is_recording(&self) -> bool {
        !matches!(self, Self::Parquet(_) | Self::Text(_))
    }
}

/// Whether hapticd has written it.
fn is_recording(reader: &SerializedFileReader<File>) -> bool {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    pairs
        .into_iter()
        .flatten()
        .any(|pair| pair.key.starts_with(RECORDING_KEY))
}
