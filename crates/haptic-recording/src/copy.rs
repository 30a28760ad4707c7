//! Makes a recording from another one.

use crate::error::{CopyError, CreateError, Ending, RecordingError};
use crate::format::Format;
use crate::mark::{Entry, Mark};
use crate::metadata::Metadata;
use crate::parquet;
use crate::reader::{Reader, open_any};
use crate::recorder::Gaps;
use crate::writer::{Totals, Writer};
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// What a repair came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairOutcome {
    /// What the repaired recording holds.
    pub totals: Totals,
    /// Bytes that could not be read; those of a damaged group of rows of Parquet are not counted.
    pub dropped_bytes: u64,
    /// How the recording ended before.
    pub ending: Ending,
}

/// Writes a recording in another format, with all that it holds. One without an end stays without.
///
/// # Errors
/// The recording is damaged elsewhere than at its end, or the copy cannot be written. Then there is
/// no copy.
pub fn export(from: &Path, to: &Path, replace: bool) -> Result<Totals, CopyError> {
    let reader = Source::open(from)?;
    let copy = Copy::new(to, reader.metadata(), replace)?;
    copy_all(reader, copy)
}

/// Writes a recording as a Parquet file of a set of many, which is never replaced: in encodings that every reader
/// knows.
///
/// # Errors
/// As [`export`].
pub fn collect(from: &Path, to: &Path) -> Result<Totals, CopyError> {
    let reader = Source::open(from)?;
    let copy = Copy::with(to, reader.metadata(), false, parquet::Numbers::Plain)?;
    copy_all(reader, copy)
}

fn copy_all(mut reader: Source, mut copy: Copy) -> Result<Totals, CopyError> {
    while let Some(entry) = reader.next()? {
        copy.entry(&entry)?;
    }
    copy.finish(reader.is_complete())
}

/// Writes what can be read of a damaged or broken off recording as a whole one. `to` may be `from`,
/// which is then replaced. Damage in its middle is marked as lost rows, and an end that it lacked
/// by a marker.
///
/// # Errors
/// The recording's metadata cannot be read, or the repaired one cannot be written. Then the old one
/// stays.
pub fn repair(from: &Path, to: &Path, replace: bool) -> Result<RepairOutcome, CopyError> {
    let mut reader = Source::open(from)?;
    reader.reader.tolerate();
    let mut copy = Copy::new(to, reader.metadata(), replace)?;
    let mut gaps = Gaps::new(reader.metadata());
    let (mut last_tick, mut is_damaged) = (0, false);
    loop {
        match reader.reader.next() {
            None => break,
            Some(Err(error @ RecordingError::Read { .. })) => return Err(reader.failed(error)),
            Some(Err(_)) => is_damaged = true,
            Some(Ok(entry)) => {
                match &entry {
                    Entry::Mark(Mark::Lost { rows }) => gaps.announce(*rows),
                    Entry::Mark(_) => {}
                    Entry::Row(row, _) => {
                        let rows = gaps.next(row).lost;
                        if std::mem::take(&mut is_damaged) && rows > 0 {
                            copy.entry(&Entry::Mark(Mark::Lost { rows }))?;
                        }
                        last_tick = row.tick;
                    }
                }
                copy.entry(&entry)?;
            }
        }
    }
    let ending = reader.reader.ending().unwrap_or(Ending::Open);
    if ending != Ending::Complete {
        let (tick, text) = (last_tick, "the recording was broken off here".to_owned());
        copy.entry(&Entry::Mark(Mark::Marker { tick, text }))?;
    }
    Ok(RepairOutcome {
        dropped_bytes: reader.reader.dropped(),
        ending,
        totals: copy.finish(true)?,
    })
}

/// A recording that is read, with its name for errors.
pub(crate) struct Source {
    reader: Reader,
    path: PathBuf,
}

impl Source {
    pub(crate) fn open(path: &Path) -> Result<Self, CopyError> {
        match open_any(path) {
            Ok(reader) => Ok(Self {
                reader,
                path: path.to_path_buf(),
            }),
            Err(source) => Err(CopyError::Read {
                path: path.to_path_buf(),
                source,
            }),
        }
    }

    pub(crate) fn metadata(&self) -> &Metadata {
        self.reader.metadata()
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn next(&mut self) -> Result<Option<Entry>, CopyError> {
        self.reader.next().transpose().map_err(|error| self.failed(error))
    }

    pub(crate) fn is_complete(&self) -> bool {
        self.reader.ending() == Some(Ending::Complete)
    }

    fn failed(&self, source: RecordingError) -> CopyError {
        CopyError::Read {
            path: self.path.clone(),
            source,
        }
    }
}

/// A copy in the making: a file of another name, which takes its own at the end.
pub(crate) struct Copy {
    writer: Option<Writer>,
    path: PathBuf,
    making: PathBuf,
    format: Format,
}

impl Copy {
    pub(crate) fn new(path: &Path, metadata: &Metadata, replace: bool) -> Result<Self, CopyError> {
        Self::with(path, metadata, replace, parquet::Numbers::Small)
    }

    fn with(path: &Path, metadata: &Metadata, replace: bool, numbers: parquet::Numbers) -> Result<Self, CopyError> {
        let format = Format::of(path).map_err(CreateError::from)?;
        let failed = |path: &Path, source: io::Error| CreateError::File {
            path: path.to_path_buf(),
            source,
        };
        let spool = (format == Format::Parquet).then(|| parquet::spool_of(path));
        let there = [Some(path), spool.as_deref()]
            .into_iter()
            .flatten()
            .find(|path| path.exists());
        if let Some(there) = there.filter(|_| !replace) {
            return Err(failed(there, io::ErrorKind::AlreadyExists.into()).into());
        }
        let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
        name.push(".new");
        let making = path.with_file_name(name);
        let file = File::create(&making).map_err(|source| failed(path, source))?;
        let mut copy = Self {
            writer: None,
            path: path.to_path_buf(),
            making,
            format,
        };
        let writer = Writer::of_copy(format, file, path, metadata, numbers).map_err(|source| failed(path, source))?;
        copy.writer = Some(writer);
        Ok(copy)
    }

    pub(crate) fn entry(&mut self, entry: &Entry) -> Result<(), CopyError> {
        let written = self.writer.as_mut().map_or(Ok(()), |writer| writer.entry(entry));
        written.map_err(|source| self.failed(source))
    }

    /// Gives the copy its name; says in it that it is complete, or leaves it without an end.
    pub(crate) fn finish(mut self, is_complete: bool) -> Result<Totals, CopyError> {
        let finished = match self.writer.take() {
            Some(writer) if is_complete => writer.finish(),
            Some(writer) => writer.break_off(),
            None => Ok(Totals::default()),
        };
        let totals = finished.map_err(|source| self.failed(source))?;
        std::fs::rename(&self.making, &self.path).map_err(|source| self.failed(source))?;
        if self.format == Format::Parquet {
            // What was there in its place until now.
            match std::fs::remove_file(parquet::spool_of(&self.path)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(self.failed(error)),
                _ => {}
            }
        }
        Ok(totals)
    }

    fn failed(&self, source: io::Error) -> CopyError {
        CopyError::Write {
            path: self.path.clone(),
            source,
        }
    }
}

impl Drop for Copy {
    fn drop(&mut self) {
        // It is there no more where it has its name.
        std::fs::remove_file(&self.making).unwrap_or_default();
    }
}
