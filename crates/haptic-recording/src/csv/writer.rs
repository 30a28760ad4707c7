//! Writes CSV.

use super::TITLE;
use crate::columns::columns;
use crate::format::version;
use crate::mark::Mark;
use crate::metadata::Metadata;
use crate::rows::Rows;
use crate::writer::Sink;
use serde::Serialize;
use std::io::{self, BufWriter, Write};

/// Writes rows and marks into a buffer.
pub(crate) struct Writer<W: Write> {
    out: CountingWriter<BufWriter<W>>,
}

impl<W: Write> Writer<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub(crate) fn new(out: W, metadata: &Metadata) -> io::Result<Self> {
        let mut writer = Self {
            out: CountingWriter {
                inner: BufWriter::new(out),
                bytes: 0,
            },
        };
        writeln!(writer.out, "{TITLE}{}", version(metadata.axes))?;
        writer.remark(metadata)?;
        let names: Vec<&str> = columns(metadata.axes).iter().map(|column| column.name).collect();
        writeln!(writer.out, "{}", names.join(","))?;
        writer.out.flush()?;
        Ok(writer)
    }

    fn remark<T: Serialize>(&mut self, value: &T) -> io::Result<()> {
        let text = serde_json::to_string(value).map_err(io::Error::other)?;
        writeln!(self.out, "# {text}")
    }
}

impl<W: Write + Send> Sink for Writer<W> {
    fn rows(&mut self, rows: Rows<'_>) -> io::Result<()> {
        let mut csv = ::csv::WriterBuilder::new()
            .has_headers(false)
            .from_writer(&mut self.out);
        for (row, y) in rows.iter() {
            let written = match y {
                None => csv.serialize(row),
                Some(y) => csv.serialize((row, y.cells())),
            };
            written.map_err(|error| match error.into_kind() {
                ::csv::ErrorKind::Io(error) => error,
                kind => io::Error::other(format!("{kind:?}")),
            })?;
        }
        csv.flush()
    }

    fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        self.remark(mark)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn finish(mut self: Box<Self>) -> io::Result<u64> {
        self.flush()?;
        Ok(self.out.bytes)
    }

    fn bytes(&self) -> u64 {
        self.out.bytes
    }
}

/// Counts what goes through it.
#[derive(Debug)]
struct CountingWriter<W> {
    inner: W,
    bytes: u64,
}

impl<W: Write> Write for CountingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{metadata, sample};

    #[test]
    fn a_reader_that_has_gone_is_distinguished_from_other_errors() {
        let (reader, pipe) = io::pipe().expect("a pipe");
        let mut writer = Writer::new(pipe, &metadata()).expect("begun");
        drop(reader);
        // More than is kept in memory.
        let error = writer
            .rows(Rows {
                samples: &[sample(1); 1000],
                ys: &[],
            })
            .expect_err("nobody reads it");
        assert_eq!(error.kind(), io::ErrorKind::BrokenPipe);
    }
}
