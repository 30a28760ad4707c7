//! Writes a recording as it comes.

use super::{Mark, Metadata, TITLE, VERSION};
use haptic_ipc::{SAMPLE_COLUMNS, Sample};
use serde::Serialize;
use std::io::{self, BufWriter, Write};
use std::time::{Duration, Instant};

/// Longest time that a row stays in memory while others follow.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// Writes rows and marks. What is written is buffered, and passed on at least each second while
/// more is written.
#[derive(Debug)]
pub struct Writer<W: Write> {
    out: Counted<BufWriter<W>>,
    rows: u64,
    lost: u64,
    flushed: Instant,
}

impl<W: Write> Writer<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub fn new(out: W, metadata: &Metadata) -> io::Result<Self> {
        let mut writer = Self {
            out: Counted {
                inner: BufWriter::new(out),
                bytes: 0,
            },
            rows: 0,
            lost: 0,
            flushed: Instant::now(),
        };
        writeln!(writer.out, "{TITLE}{VERSION}")?;
        writer.remark(metadata)?;
        writeln!(writer.out, "{}", SAMPLE_COLUMNS.join(","))?;
        writer.flush()?;
        Ok(writer)
    }

    /// Writes rows. Numbers are written so that they read back exactly.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn rows(&mut self, rows: &[Sample]) -> io::Result<()> {
        let mut csv = csv::WriterBuilder::new().has_headers(false).from_writer(&mut self.out);
        for row in rows {
            csv.serialize(row).map_err(io::Error::other)?;
        }
        csv.flush()?;
        drop(csv);
        self.rows += rows.len() as u64;
        self.flush_in_time()
    }

    /// Writes what happened before the next row.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        if let Mark::Lost { rows } = mark {
            self.lost += rows;
        }
        self.remark(mark)?;
        self.flush_in_time()
    }

    /// Passes on what is in memory.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.flushed = Instant::now();
        self.out.flush()
    }

    /// Ends the recording, and says in it that this is its end. Returns where it was written to,
    /// and its size in bytes.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<(W, u64)> {
        self.remark(&Mark::End {
            rows: self.rows,
            lost: self.lost,
        })?;
        let out = self.out.inner.into_inner().map_err(io::IntoInnerError::into_error)?;
        Ok((out, self.out.bytes))
    }

    /// Rows written.
    #[must_use]
    pub const fn row_count(&self) -> u64 {
        self.rows
    }

    /// Rows marked as lost.
    #[must_use]
    pub const fn lost(&self) -> u64 {
        self.lost
    }

    /// Bytes written.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.out.bytes
    }

    fn remark<T: Serialize>(&mut self, value: &T) -> io::Result<()> {
        let text = serde_json::to_string(value).map_err(io::Error::other)?;
        writeln!(self.out, "# {text}")
    }

    fn flush_in_time(&mut self) -> io::Result<()> {
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(())
    }
}

/// Counts what goes through it.
#[derive(Debug)]
struct Counted<W> {
    inner: W,
    bytes: u64,
}

impl<W: Write> Write for Counted<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
