//! Writes MCAP.

use super::layout::Layout;
use super::tail::Tail;
use super::{MARK_SCHEMA, MARKS, METADATA, SAMPLES};
use crate::mark::Mark;
use crate::metadata::{Metadata, to_fields};
use crate::rows::Rows;
use crate::writer::Sink;
use haptic_ipc::Sample;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes rows and marks into a chunk in memory.
pub(crate) struct Writer {
    mcap: mcap::Writer<NoSeek<Tail>>,
    layout: Layout,
    samples: u16,
    marks: u16,
    /// A row, as it is written.
    data: Vec<u8>,
    clock: Clock,
    /// Whether the chunk holds a message.
    is_due: bool,
    size: Arc<AtomicU64>,
}

/// The moments of rows, ns since 1970.
struct Clock {
    started_s: f64,
    first_s: Option<f64>,
    /// The last message's.
    now_ns: u64,
    tick: u64,
}

impl Writer {
    /// Begins a recording in a file.
    ///
    /// # Errors
    /// It cannot be written to.
    pub(crate) fn new(file: File, metadata: &Metadata) -> io::Result<Self> {
        let options = WriteOptions::new()
            .library(concat!("hapticd ", env!("CARGO_PKG_VERSION")))
            // The default seeks back to the length of a chunk, and leaves none where it is killed.
            .disable_seeking(true)
            .chunk_size(None)
            .compression(None)
            .calculate_data_section_crc(false);
        let tail = Tail::new(file)?;
        let size = tail.size();
        let mut mcap = options.create(NoSeek::new(tail)).map_err(io_error)?;
        mcap.write_metadata(&mcap::write::Metadata {
            name: METADATA.to_owned(),
            metadata: to_fields(metadata)?.into_iter().collect(),
        })
        .map_err(io_error)?;
        mcap.flush().map_err(io_error)?;
        let none = BTreeMap::new();
        let sample = mcap.add_schema(
            "hapticd/msg/Sample",
            "ros2msg",
            Layout::schema(metadata.axes).as_bytes(),
        );
        let samples = mcap.add_channel(sample.map_err(io_error)?, SAMPLES, "cdr", &none);
        let mark = mcap.add_schema("hapticd.Mark", "jsonschema", MARK_SCHEMA.as_bytes());
        let marks = mcap.add_channel(mark.map_err(io_error)?, MARKS, "json", &none);
        let started_ns = nanoseconds(metadata.started_unix_s);
        Ok(Self {
            mcap,
            layout: Layout::current(metadata.axes),
            samples: samples.map_err(io_error)?,
            marks: marks.map_err(io_error)?,
            data: Vec::new(),
            clock: Clock {
                started_s: metadata.started_unix_s,
                first_s: None,
                now_ns: started_ns,
                tick: 0,
            },
            is_due: false,
            size,
        })
    }
}

impl Sink for Writer {
    fn rows(&mut self, rows: Rows<'_>) -> io::Result<()> {
        for (row, y) in rows.iter() {
            self.layout.encode(row, y, &mut self.data);
            self.clock.advance(row);
            let header = self.clock.header(self.samples);
            self.mcap
                .write_to_known_channel(&header, &self.data)
                .map_err(io_error)?;
        }
        self.is_due |= !rows.samples.is_empty();
        Ok(())
    }

    fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        let text = serde_json::to_vec(mark)?;
        let header = self.clock.header(self.marks);
        self.is_due = true;
        self.mcap.write_to_known_channel(&header, &text).map_err(io_error)
    }

    /// Puts the chunk into the file.
    fn flush(&mut self) -> io::Result<()> {
        // A chunk without a message would say that the recording began in 1970.
        if !std::mem::take(&mut self.is_due) {
            return Ok(());
        }
        self.mcap.flush().map_err(io_error)
    }

    fn bytes(&self) -> u64 {
        self.size.load(Ordering::Relaxed)
    }

    /// Adds the summary.
    fn finish(mut self: Box<Self>) -> io::Result<u64> {
        self.mcap.finish().map_err(io_error)?;
        self.mcap.into_inner().into_inner().finish()?;
        Ok(self.size.load(Ordering::Relaxed))
    }
}

impl Clock {
    fn advance(&mut self, row: &Sample) {
        let since_s = row.t_s - *self.first_s.get_or_insert(row.t_s);
        self.now_ns = nanoseconds(self.started_s).saturating_add(nanoseconds(since_s));
        self.tick = row.tick;
    }

    fn header(&self, channel_id: u16) -> MessageHeader {
        MessageHeader {
            channel_id,
            #[expect(clippy::cast_possible_truncation, reason = "the lower half")]
            sequence: self.tick as u32,
            log_time: self.now_ns,
            publish_time: self.now_ns,
        }
    }
}

fn nanoseconds(time_s: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates; not a number becomes 0"
    )]
    let time_ns = (time_s * 1e9).round() as u64;
    time_ns
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}
