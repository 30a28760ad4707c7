//! Writes what is read from one recording into another, in any format.

use super::report::Report;
use crate::failure::Failure;
use clap::ValueHint;
use haptic_ipc::Sample;
use haptic_lab::recording::{CreateError, Mark, Metadata, Writer};
use std::io;
use std::path::{Path, PathBuf};

/// Rows that are written at a time.
const BATCH: usize = 1000;

/// The recording that is written.
#[derive(Debug, clap::Args)]
pub(super) struct Output {
    /// Recording to write; its name ends in .mcap, .csv or .parquet
    #[arg(value_hint = ValueHint::FilePath)]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

impl Output {
    /// Begins the recording that is written.
    pub(super) fn create(&self, from: &Path, metadata: &Metadata) -> Result<Copy<'_>, Failure> {
        if crate::simulate::is_same_file(from, &self.out) {
            let (out, from) = (self.out.display(), from.display());
            return Err(Failure::Usage(format!(
                "{out} would be written over {from}: name another file"
            )));
        }
        let writer = Writer::create(&self.out, metadata, self.force).map_err(|error| match error {
            CreateError::File { source, .. } if source.kind() == io::ErrorKind::AlreadyExists => exists(&self.out),
            error => Failure::Usage(error.to_string()),
        })?;
        Ok(Copy {
            path: &self.out,
            writer: Some(writer),
            rows: Vec::with_capacity(BATCH),
            markers: 0,
        })
    }
}

/// The refusal to replace a file.
pub(crate) fn exists(file: &Path) -> Failure {
    Failure::Usage(format!("{} exists; --force replaces it", file.display()))
}

/// A recording that is being written. Without an end it is removed.
pub(super) struct Copy<'a> {
    path: &'a Path,
    writer: Option<Writer>,
    rows: Vec<Sample>,
    markers: u64,
}

impl<'a> Copy<'a> {
    pub(super) fn row(&mut self, row: Sample) -> Result<(), Failure> {
        self.rows.push(row);
        if self.rows.len() < BATCH {
            return Ok(());
        }
        self.pass_on_rows()
    }

    pub(super) fn mark(&mut self, mark: &Mark) -> Result<(), Failure> {
        self.pass_on_rows()?;
        self.markers += u64::from(matches!(mark, Mark::Marker { .. }));
        self.write(|writer| writer.mark(mark))
    }

    /// Ends the recording, as one that was ended on purpose or not.
    pub(super) fn end(mut self, is_complete: bool) -> Result<Report<'a>, Failure> {
        self.pass_on_rows()?;
        let path = self.path;
        let ended = match self.writer.take() {
            Some(writer) if is_complete => writer.finish(),
            Some(writer) => writer.break_off(),
            None => Ok(haptic_lab::recording::Totals::default()),
        };
        let totals = ended.map_err(|error| not_written(path, &error))?;
        Ok(Report {
            file: path,
            totals,
            markers: self.markers,
            is_complete,
        })
    }

    fn pass_on_rows(&mut self) -> Result<(), Failure> {
        let rows = std::mem::take(&mut self.rows);
        let written = self.write(|writer| writer.rows(&rows));
        self.rows = rows;
        self.rows.clear();
        written
    }

    fn write(&mut self, write: impl FnOnce(&mut Writer) -> io::Result<()>) -> Result<(), Failure> {
        match &mut self.writer {
            Some(writer) => write(writer).map_err(|error| not_written(self.path, &error)),
            None => Ok(()),
        }
    }
}

impl Drop for Copy<'_> {
    fn drop(&mut self) {
        if self.writer.take().is_some() {
            // Where it cannot be removed, the failure that ends the program says enough.
            std::fs::remove_file(self.path).unwrap_or_default();
        }
    }
}

fn not_written(path: &Path, error: &io::Error) -> Failure {
    Failure::File(format!("{}: {error}", path.display()))
}
