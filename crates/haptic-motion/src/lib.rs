//! Motions of a hand in files, read row by row.
//!
//! A motion is a table with a column of times and one of positions. It is a recording of hapticd or
//! a table of any other program, in one of three formats, which is known by the first bytes:
//!
//! | format | a row |
//! |---|---|
//! | CSV | a line; the first line names the columns, and lines of `#` are comments |
//! | MCAP | a message in `cdr` of the first channel whose `ros2msg` schema has a field `t_s` |
//! | Parquet | a row |
//!
//! | column | what | unit |
//! |---|---|---|
//! | `t_s` | time; it may be irregular, but grows | s |
//! | `position_m` or `device_position_m` | position | m |
//! | `velocity_mps` or `device_velocity_mps` | velocity, where it was measured | m/s |
//!
//! Recordings have the longer names. A table with both names of a quantity is refused, since either
//! could be meant. Other columns are ignored.
//!
//! A recording that was broken off reads up to its last whole row.

mod columns;
mod csv_table;
mod error;
pub mod guard;
mod input;
mod mcap_table;
pub mod numbers;
mod parquet_table;
mod row;
mod whole_lines;

pub use error::{MotionError, Place};
pub use row::{LARGEST, Row};

use columns::Columns;
use csv_table::CsvTable;
use mcap_table::McapTable;
use parquet_table::ParquetTable;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

/// A motion file: an iterator over its rows. After an error nothing follows.
#[expect(missing_debug_implementations, reason = "the readers of the formats have none")]
pub struct Rows {
    path: PathBuf,
    table: Table,
    before_s: Option<f64>,
    failed: bool,
}

enum Table {
    Csv(CsvTable),
    Mcap(McapTable),
    Parquet(ParquetTable),
}

/// The file that holds a motion. A recording in Parquet that is being made, or was broken off, is an MCAP file
/// beside its own.
#[must_use]
pub fn file_of(path: &Path) -> PathBuf {
    let is_parquet = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"));
    let mut name = path.as_os_str().to_owned();
    name.push(".partial.mcap");
    let partial = PathBuf::from(name);
    if is_parquet && partial.exists() {
        partial
    } else {
        path.to_path_buf()
    }
}

impl Rows {
    /// Opens a file and finds its columns.
    ///
    /// # Errors
    /// The file cannot be read, or is not a motion.
    pub fn open(path: &Path) -> Result<Self, MotionError> {
        let path = &file_of(path);
        let file = File::open(path).map_err(|source| MotionError::open(path, source))?;
        Self::new(path, file)
    }

    /// The same for a [file](file_of) that the caller has opened; `path` is its name.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn new(path: &Path, mut file: File) -> Result<Self, MotionError> {
        const MAGIC_BYTES: u64 = 20;
        let mut first = Vec::new();
        (&mut file)
            .take(MAGIC_BYTES)
            .read_to_end(&mut first)
            .map_err(|source| MotionError::open(path, source))?;
        if first.is_empty() {
            return Err(MotionError::format(path, "the file is empty"));
        }
        let table = if first.starts_with(parquet_table::MAGIC) {
            Table::Parquet(ParquetTable::new(path, file)?)
        } else {
            let (is_mcap, is_recording) = (
                first.starts_with(mcap::MAGIC),
                first.starts_with(csv_table::RECORDING_TITLE),
            );
            // A character may continue beyond the first bytes.
            let is_text = std::str::from_utf8(&first).map_or_else(|error| error.error_len().is_none(), |_| true)
                && !first.contains(&0);
            let input = Cursor::new(first).chain(file);
            if is_mcap {
                Table::Mcap(McapTable::new(path, input)?)
            } else if !is_text {
                let reason = "not a table: it is neither MCAP nor Parquet, nor text in UTF-8, as CSV is";
                return Err(MotionError::format(path, reason));
            } else {
                Table::Csv(CsvTable::new(path, input, is_recording)?)
            }
        };
        Ok(Self {
            path: path.to_path_buf(),
            table,
            before_s: None,
            failed: false,
        })
    }

    /// Whether its rows have velocities.
    #[must_use]
    pub fn has_velocity(&self) -> bool {
        self.columns().velocity.is_some()
    }

    fn columns(&self) -> &Columns {
        match &self.table {
            Table::Csv(table) => table.columns(),
            Table::Mcap(table) => table.columns(),
            Table::Parquet(table) => table.columns(),
        }
    }

    fn row(&mut self) -> Result<Option<Row>, MotionError> {
        let next = match &mut self.table {
            Table::Csv(table) => table.row()?,
            Table::Mcap(table) => table.row()?,
            Table::Parquet(table) => table.row()?,
        };
        let Some((place, row)) = next else { return Ok(None) };
        let columns = self.columns();
        let velocity = columns.velocity.as_ref().zip(row.velocity_mps);
        let cells = [
            Some((&columns.time, row.t_s)),
            Some((&columns.position, row.position_m)),
            velocity,
        ];
        for (column, value) in cells.into_iter().flatten() {
            if value.is_nan() || value.abs() > LARGEST {
                return Err(MotionError::not_a_number(&self.path, place, column.name, value));
            }
        }
        if let Some(before) = self.before_s.filter(|&before| row.t_s <= before) {
            return Err(MotionError::TimeNotIncreasing {
                path: self.path.clone(),
                place,
                t_s: row.t_s,
                before,
            });
        }
        self.before_s = Some(row.t_s);
        Ok(Some(row))
    }
}

impl Iterator for Rows {
    type Item = Result<Row, MotionError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let row = self.row();
        self.failed = row.is_err();
        row.transpose()
    }
}

#[cfg(test)]
mod tests;
