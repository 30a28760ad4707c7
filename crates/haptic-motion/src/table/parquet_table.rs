//! A table that another program has written as Parquet.

use super::error::TableError;
use crate::guard::guarded;
use crate::numbers::{Numbers, NumbersError, is_in_seconds};
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A table, open for reading.
#[expect(missing_debug_implementations, reason = "the library's reader has none")]
pub struct ParquetTable {
    path: PathBuf,
    reader: SerializedFileReader<File>,
}

impl ParquetTable {
    pub(crate) fn new(path: &Path, reader: SerializedFileReader<File>) -> Self {
        let path = path.to_path_buf();
        Self { path, reader }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The names of its columns.
    pub(super) fn names(&self) -> Vec<String> {
        let schema = self.reader.metadata().file_metadata().schema_descr_ptr();
        schema.columns().iter().map(|column| column.path().string()).collect()
    }

    /// Which columns are read in s, whatever their titles say.
    pub(super) fn in_seconds(&self) -> Vec<bool> {
        let schema = self.reader.metadata().file_metadata().schema_descr_ptr();
        schema.columns().iter().map(|column| is_in_seconds(column)).collect()
    }

    /// All cells of a column.
    pub(super) fn column(&self, index: usize) -> Result<Vec<f64>, TableError> {
        let descriptor = self.reader.metadata().file_metadata().schema_descr_ptr().column(index);
        let name = descriptor.path().string();
        let failed =
            |reason: String| TableError::of(&self.path, format_args!("the column `{name}` is not read: {reason}"));
        if descriptor.max_rep_level() > 0 {
            return Err(failed("of lists: one number a row expected".to_owned()));
        }
        let mut cells = Vec::new();
        for group in 0..self.reader.num_row_groups() {
            let opened = guarded(|| Numbers::open(&*self.reader.get_row_group(group)?, index));
            let mut numbers = opened.map_err(failed)?;
            loop {
                let before = cells.len();
                numbers
                    .read(&mut cells)
                    .map_err(|error: NumbersError| failed(error.to_string()))?;
                if cells.len() == before {
                    break;
                }
            }
        }
        Ok(cells)
    }
}
