//! A table that another program has written as Parquet.

use super::error::RecordFileError;
use haptic_motion::guard::guarded;
use haptic_motion::numbers::{Numbers, NumbersError, is_in_seconds};
use haptic_recording::{Place, parquet::KEY};
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A table, open for reading.
pub(super) struct ParquetTable {
    path: PathBuf,
    reader: SerializedFileReader<File>,
}

impl ParquetTable {
    /// Opens a file; `None` where it is something else, damaged, or a recording of hapticd.
    pub(super) fn open(path: &Path) -> Result<Option<Self>, RecordFileError> {
        let file = File::open(path).map_err(|source| RecordFileError::Open {
            path: path.to_path_buf(),
            source,
        })?;
        let Ok(reader) = guarded(|| SerializedFileReader::new(file)) else {
            return Ok(None);
        };
        let pairs = reader.metadata().file_metadata().key_value_metadata();
        let is_ours = pairs.into_iter().flatten().any(|pair| pair.key.starts_with(KEY));
        let path = path.to_path_buf();
        Ok((!is_ours).then_some(Self { path, reader }))
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
    pub(super) fn column(&self, index: usize) -> Result<Vec<f64>, RecordFileError> {
        let descriptor = self.reader.metadata().file_metadata().schema_descr_ptr().column(index);
        let name = descriptor.path().string();
        let failed = |reason: String| RecordFileError::Parquet {
            path: self.path.clone(),
            column: name.clone(),
            reason,
        };
        if descriptor.max_rep_level() > 0 {
            return Err(failed("of lists: one number a row expected".to_owned()));
        }
        let mut cells = Vec::new();
        for group in 0..self.reader.num_row_groups() {
            let opened = guarded(|| Numbers::open(&*self.reader.get_row_group(group)?, index));
            let mut numbers = opened.map_err(failed)?;
            loop {
                let before = cells.len();
                let empty = numbers
                    .read(&mut cells)
                    .map_err(|error: NumbersError| failed(error.to_string()))?;
                if let Some(empty) = empty {
                    return Err(RecordFileError::NotANumber {
                        path: self.path.clone(),
                        place: Place::Row((before + empty + 1) as u64),
                        column: name.clone(),
                        value: String::new(),
                    });
                }
                if cells.len() == before {
                    break;
                }
            }
        }
        Ok(cells)
    }
}
