//! A Parquet recording in the making: an MCAP file beside it.

use super::{Numbers, Writer, spool_of};
use crate::error::RecordingError;
use crate::mark::{Entry, Mark};
use crate::mcap;
use crate::metadata::Metadata;
use crate::reader::Source as _;
use crate::rows::Rows;
use crate::writer::Sink;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

/// Rows and marks on their way into a Parquet file.
pub(crate) struct Spool {
    mcap: Box<mcap::Writer>,
    path: PathBuf,
    metadata: Metadata,
    parquet: File,
}

impl Spool {
    /// Begins a recording whose Parquet file is there, and empty; returns the file that is written
    /// meanwhile as well.
    ///
    /// # Errors
    /// That cannot be created, or is there already.
    pub(crate) fn new(parquet: File, path: &Path, metadata: &Metadata) -> io::Result<(Self, File)> {
        if !parquet.metadata()?.is_file() {
            let reason = "Parquet is written into files alone";
            return Err(io::Error::new(io::ErrorKind::Unsupported, reason));
        }
        let path = spool_of(path);
        let named = |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
        let file = File::create_new(&path).map_err(named)?;
        let spool = Self {
            mcap: Box::new(mcap::Writer::new(file.try_clone()?, metadata)?),
            metadata: metadata.clone(),
            parquet,
            path,
        };
        Ok((spool, file))
    }
}

impl Sink for Spool {
    fn rows(&mut self, rows: Rows<'_>) -> io::Result<()> {
        self.mcap.rows(rows)
    }

    fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        self.mcap.mark(mark)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.mcap.flush()
    }

    fn bytes(&self) -> u64 {
        self.mcap.bytes()
    }

    /// Moves everything into the Parquet file. Where that fails, everything stays where it is.
    fn finish(self: Box<Self>) -> io::Result<u64> {
        let Self {
            mcap,
            path,
            metadata,
            parquet,
        } = *self;
        mcap.finish()?;
        let moved = convert(&path, &parquet, &metadata).and_then(|bytes| {
            parquet.sync_all()?;
            Ok(bytes)
        });
        match moved {
            Ok(bytes) => {
                std::fs::remove_file(&path)?;
                Ok(bytes)
            }
            Err(error) => {
                // Half a Parquet file is worth nothing, and takes room.
                parquet.set_len(0).unwrap_or_default();
                let stays = format!("{error}; everything recorded is in {}", path.display());
                Err(io::Error::new(error.kind(), stays))
            }
        }
    }
}

fn convert(spool: &Path, parquet: &File, metadata: &Metadata) -> io::Result<u64> {
    let mut input = BufReader::with_capacity(1 << 16, File::open(spool)?);
    input.read_exact(&mut [0; ::mcap::MAGIC.len()])?;
    let other = |error: RecordingError| io::Error::other(error);
    let mut reader = mcap::Reader::new(input).map_err(other)?;
    let mut writer = Box::new(Writer::new(parquet, metadata, Numbers::Small)?);
    while let Some(entry) = reader.entry().map_err(other)? {
        match entry {
            Entry::Row(row, y) => writer.rows(Rows::one(&row, y.as_ref()))?,
            Entry::Mark(mark) => writer.mark(&mark)?,
        }
    }
    writer.finish()
}
