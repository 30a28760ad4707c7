//! Writes a recording in any format.

use crate::error::CreateError;
use crate::format::Format;
use crate::mark::{Entry, Mark};
use crate::metadata::Metadata;
use crate::rows::Rows;
use crate::{csv, mcap, parquet};
use haptic_ipc::{Sample, SampleY};
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::slice;
use std::time::{Duration, Instant};

/// Longest time that a row stays in memory while others follow.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// Most rows that stay in memory: a quarter of a second at 1 kHz.
const FLUSH_ROWS: u64 = 250;

/// What a loss of power takes at most. The thread that writes waits for the disk, and rows wait in its queue: a minute's
/// at 1 kHz, three seconds' at 20 kHz.
const SYNC_EVERY: Duration = Duration::from_secs(5);

/// How much a recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Rows.
    pub rows: u64,
    /// Rows that are missing.
    pub lost: u64,
    /// Changes of state, scene or settings, and markers, that are missing.
    pub lost_changes: u64,
    /// Periods that the daemon's loop missed.
    pub missed: u64,
    /// Size, bytes.
    pub bytes: u64,
    /// Time from the first row to the last, s.
    pub length_s: f64,
}

/// Writes rows and marks, as they come.
pub struct Writer {
    sink: Box<dyn Sink>,
    /// The file that is written now.
    file: File,
    synced: Instant,
    axes: u8,
    totals: Totals,
    first_s: Option<f64>,
    unflushed: u64,
    flushed: Instant,
}

/// What writes one format. Nothing of it can be written where its methods fail.
pub(crate) trait Sink: Send {
    /// Writes rows. Numbers are written so that they read back exactly.
    fn rows(&mut self, rows: Rows<'_>) -> io::Result<()>;

    /// Writes what happened before the next row.
    fn mark(&mut self, mark: &Mark) -> io::Result<()>;

    /// Passes on what is in memory.
    fn flush(&mut self) -> io::Result<()>;

    /// Size by now, bytes.
    fn bytes(&self) -> u64;

    /// Ends it; returns its size, bytes.
    fn finish(self: Box<Self>) -> io::Result<u64>;
}

impl Writer {
    /// Creates a recording; the ending of its name says its format.
    ///
    /// # Errors
    /// The name says no format, the file cannot be written, or it is there and not to be replaced.
    pub fn create(path: &Path, metadata: &Metadata, replace: bool) -> Result<Self, CreateError> {
        let (format, file) = new_file(path, replace)?;
        Self::new(format, file, path, metadata).map_err(|source| failed(path, source))
    }

    /// Begins a recording of which nothing need be readable before its end.
    pub(crate) fn of_copy(
        format: Format,
        file: File,
        path: &Path,
        metadata: &Metadata,
        numbers: parquet::Numbers,
    ) -> io::Result<Self> {
        if format == Format::Parquet {
            let parquet = parquet::Writer::new(file.try_clone()?, metadata, numbers)?;
            return Ok(Self::with(parquet, file, metadata));
        }
        Self::new(format, file, path, metadata)
    }

    /// Begins a recording in a file that was created for it, and is at `path`, or in a pipe.
    ///
    /// # Errors
    /// It cannot be written to, or is a pipe and the format Parquet.
    pub fn new(format: Format, file: File, path: &Path, metadata: &Metadata) -> io::Result<Self> {
        let copy = file.try_clone()?;
        Ok(match format {
            Format::Csv => Self::with(csv::Writer::new(copy, metadata)?, file, metadata),
            Format::Mcap => Self::with(mcap::Writer::new(copy, metadata)?, file, metadata),
            Format::Parquet => {
                let (spool, file) = parquet::Spool::new(file, path, metadata)?;
                Self::with(spool, file, metadata)
            }
        })
    }

    fn with(sink: impl Sink + 'static, file: File, metadata: &Metadata) -> Self {
        Self {
            sink: Box::new(sink),
            synced: Instant::now(),
            file,
            axes: metadata.axes,
            totals: Totals::default(),
            first_s: None,
            unflushed: 0,
            flushed: Instant::now(),
        }
    }

    /// Writes a row or a mark.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn entry(&mut self, entry: &Entry) -> io::Result<()> {
        match entry {
            Entry::Row(row, y) => self.rows(slice::from_ref(row), y.as_slice()),
            Entry::Mark(mark) => self.mark(mark),
        }
    }

    /// Writes rows, with what each has of a second axis: nothing on a rig of one. Numbers are written so that they
    /// read back exactly.
    ///
    /// # Errors
    /// They cannot be written, or have not as many axes as the recording.
    pub fn rows(&mut self, rows: &[Sample], rows_y: &[SampleY]) -> io::Result<()> {
        self.put_rows(Rows::of(rows, rows_y, self.axes)?)
    }

    pub(crate) fn put_rows(&mut self, rows: Rows<'_>) -> io::Result<()> {
        let (Some(first), Some(last)) = (rows.samples.first(), rows.samples.last()) else {
            return Ok(());
        };
        self.sink.rows(rows)?;
        self.totals.length_s = last.t_s - *self.first_s.get_or_insert(first.t_s);
        self.totals.rows += rows.samples.len() as u64;
        self.unflushed += rows.samples.len() as u64;
        self.flush_in_time()
    }

    /// Writes what happened before the next row. An [`End`](Mark::End) is written by
    /// [`finish`](Self::finish) alone.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        match mark {
            Mark::End { .. } => return Ok(()),
            Mark::Lost { rows } => self.totals.lost = self.totals.lost.saturating_add(*rows),
            Mark::LostChanges { changes } => {
                self.totals.lost_changes = self.totals.lost_changes.saturating_add(*changes);
            }
            Mark::Missed { periods, .. } => self.totals.missed = self.totals.missed.saturating_add(*periods),
            _ => {}
        }
        self.sink.mark(mark)?;
        self.flush_in_time()
    }

    /// Passes on what is in memory.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.unflushed = 0;
        self.flushed = Instant::now();
        self.sink.flush()
    }

    /// Ends the recording, says in it that this is its end, and waits until it is on the disk.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<Totals> {
        self.sink.mark(&Mark::End {
            rows: self.totals.rows,
            lost: self.totals.lost,
            missed: self.totals.missed,
        })?;
        self.break_off()
    }

    /// Closes the recording without an end, as one that nobody ended on purpose.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn break_off(mut self) -> io::Result<Totals> {
        self.totals.bytes = self.sink.finish()?;
        sync(&self.file)?;
        Ok(self.totals)
    }

    /// Axes of its rig.
    pub(crate) const fn axes(&self) -> u8 {
        self.axes
    }

    /// How much it holds by now.
    #[must_use]
    pub fn totals(&self) -> Totals {
        Totals {
            bytes: self.sink.bytes(),
            ..self.totals
        }
    }

    fn flush_in_time(&mut self) -> io::Result<()> {
        if self.unflushed >= FLUSH_ROWS || self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        if self.synced.elapsed() >= SYNC_EVERY {
            self.synced = Instant::now();
            sync(&self.file)?;
        }
        Ok(())
    }
}

/// Creates a recording's file.
fn new_file(path: &Path, replace: bool) -> Result<(Format, File), CreateError> {
    let format = Format::of(path)?;
    if format == Format::Parquet {
        let spool = parquet::spool_of(path);
        if replace {
            match std::fs::remove_file(&spool) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(&spool, error)),
                _ => {}
            }
        } else if spool.exists() {
            // What a recording of this name left there.
            return Err(failed(&spool, io::ErrorKind::AlreadyExists.into()));
        }
    }
    let file = if replace {
        File::create(path)
    } else {
        File::create_new(path)
    };
    Ok((format, file.map_err(|source| failed(path, source))?))
}

fn failed(path: &Path, source: io::Error) -> CreateError {
    CreateError::File {
        path: path.to_path_buf(),
        source,
    }
}

/// Waits until a file is on the disk. A pipe is on none, nor is a spool that was moved into its recording.
fn sync(file: &File) -> io::Result<()> {
    let about = file.metadata()?;
    if about.is_file() && about.nlink() > 0 {
        file.sync_all()?;
    }
    Ok(())
}
