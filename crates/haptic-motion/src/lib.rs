//! Tables of other programs ([`table`]), and motions of a hand in files.
//!
//! A motion has a column of times and one of positions, and perhaps one of velocities. It is a recording of hapticd,
//! read row by row whatever its length, or a table of another program, read whole. The first bytes tell:
//!
//! | format | a row |
//! |---|---|
//! | CSV of hapticd | a line; the first line names the columns, and lines of `#` are comments |
//! | MCAP | a message in `cdr` of the first channel whose `ros2msg` schema has a field `t_s` |
//! | Parquet of hapticd | a row |
//! | other text, other Parquet | as [`table`] reads it |
//!
//! | column of a recording or of MCAP | what | unit |
//! |---|---|---|
//! | `t_s` | time; it may be irregular, but grows | s |
//! | `position_m` or `device_position_m` | position | m |
//! | `velocity_mps` or `device_velocity_mps` | velocity, where it was measured | m/s |
//! | `position_y_m` or `device_position_y_m` | of a motion in the plane, position on the second axis | m |
//! | `velocity_y_mps` or `device_velocity_y_mps` | velocity on the second axis, where it was measured | m/s |
//!
//! Recordings have the longer names. A recording with both names of a quantity is refused, since either could be
//! meant. Other columns are ignored. A recording that was broken off reads up to its last whole row.

pub mod cdr;
mod columns;
mod csv_table;
mod error;
pub mod guard;
mod mcap_table;
pub mod median;
pub mod numbers;
mod opened;
mod parquet_table;
pub mod table;
pub mod text;

pub use error::{MotionError, Place};
pub use opened::{Opened, PARQUET_MAGIC, RECORDING_KEY, RECORDING_TITLE};

use columns::Columns;
use csv_table::CsvTable;
use mcap_table::McapTable;
use parquet_table::ParquetTable;
use std::fs::File;
use std::path::{Path, PathBuf};
use table::{Quantity, Table, TableOptions};

/// One row of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionRow {
    /// Time, s.
    pub t_s: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s; every row of a file has one, or none.
    pub velocity_mps: Option<f64>,
    /// Position on the second axis, m; every row of a motion in the plane has one.
    pub position_y_m: Option<f64>,
    /// Velocity on the second axis, m/s, as [`velocity_mps`](Self::velocity_mps).
    pub velocity_y_mps: Option<f64>,
}

/// Largest time (s), position (m) or velocity (m/s) taken: beyond it the products that forces are
/// made of leave the range of numbers.
pub const MAX_NUMBER: f64 = 1e12;

/// A motion file: an iterator over its rows. After an error nothing follows.
#[expect(missing_debug_implementations, reason = "the readers of the formats have none")]
pub struct Rows {
    path: PathBuf,
    source: Source,
    notes: Vec<String>,
    before_s: Option<f64>,
    failed: bool,
}

enum Source {
    Csv(CsvTable),
    Mcap(McapTable),
    Parquet(ParquetTable),
    Table {
        rows: std::vec::IntoIter<(Place, MotionRow)>,
        has_second_axis: bool,
    },
}

/// Where a recording in Parquet is while it is being made: an MCAP file beside its own.
#[must_use]
pub fn spool_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial.mcap");
    name.into()
}

/// The file that holds a motion or a recording: of one in Parquet that is being made, or was broken off, its
/// [spool](spool_of).
#[must_use]
pub fn file_of(path: &Path) -> PathBuf {
    let is_parquet = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"));
    let partial = spool_of(path);
    if is_parquet && partial.exists() {
        partial
    } else {
        path.to_path_buf()
    }
}

impl Rows {
    /// Opens a file of one axis and finds its columns.
    ///
    /// # Errors
    /// The file cannot be read, or is not a motion, or is one in the plane.
    pub fn open(path: &Path) -> Result<Self, MotionError> {
        Self::open_any(path, &TableOptions::default())?.of_one_axis()
    }

    /// The same of one axis or two, where `options` say how a table is read; a recording in CSV is then one as well.
    ///
    /// # Errors
    /// The file cannot be read, or is not a motion.
    pub fn open_any(path: &Path, options: &TableOptions) -> Result<Self, MotionError> {
        let path = &file_of(path);
        let file = File::open(path).map_err(|source| MotionError::new(path, source))?;
        Self::of_file(path, file, options)
    }

    /// The same of one axis for a [file](file_of) that the caller has opened; `path` is its name.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn new(path: &Path, file: File, options: &TableOptions) -> Result<Self, MotionError> {
        Self::of_file(path, file, options)?.of_one_axis()
    }

    fn of_one_axis(self) -> Result<Self, MotionError> {
        if self.has_second_axis() {
            let column = self.columns().and_then(|columns| columns.position_y);
            let column = column.map_or("position_y_m", |column| column.name);
            let reason = format!("a motion of two axes, with a column `{column}`, and this takes one axis");
            return Err(MotionError::new(&self.path, reason));
        }
        Ok(self)
    }

    fn of_file(path: &Path, file: File, options: &TableOptions) -> Result<Self, MotionError> {
        let file = Opened::new(path, file).map_err(|source| MotionError::new(path, source))?;
        options.check_gains()?;
        // A recording is read as one unless something else is stated of its columns.
        let is_plain = *options == TableOptions::default();
        let mut notes = Vec::new();
        let source = match file {
            Opened::CsvRecording(input) if is_plain => Source::Csv(CsvTable::new(path, input)?),
            Opened::Mcap(input) if is_plain => Source::Mcap(McapTable::new(path, input)?),
            Opened::ParquetRecording(Err(reason)) => return Err(MotionError::new(path, reason)),
            Opened::ParquetRecording(Ok(reader)) if is_plain => Source::Parquet(ParquetTable::new(path, reader)?),
            file => {
                let options = TableOptions {
                    is_of_device: true,
                    ..options.clone()
                };
                // A column that is named is the only one.
                let quantities = match options.columns.position {
                    Some(_) => &MOTION[..2],
                    None => &MOTION,
                };
                Source::of_table(Table::read(path, file, &options, quantities)?, &mut notes)
            }
        };
        Ok(Self {
            path: path.to_path_buf(),
            source,
            notes,
            before_s: None,
            failed: false,
        })
    }

    /// Whether it is a motion in the plane.
    #[must_use]
    pub fn has_second_axis(&self) -> bool {
        match self.source {
            Source::Table { has_second_axis, .. } => has_second_axis,
            _ => self.columns().is_some_and(|columns| columns.position_y.is_some()),
        }
    }

    /// What was read of a table of another program, and what was left out.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn columns(&self) -> Option<&Columns> {
        match &self.source {
            Source::Csv(table) => Some(table.columns()),
            Source::Mcap(table) => Some(table.columns()),
            Source::Parquet(table) => Some(table.columns()),
            Source::Table { .. } => None,
        }
    }

    fn row(&mut self) -> Result<Option<MotionRow>, MotionError> {
        let next = match &mut self.source {
            Source::Csv(table) => table.row()?,
            Source::Mcap(table) => table.row()?,
            Source::Parquet(table) => table.row()?,
            Source::Table { rows, .. } => rows.next(),
        };
        let Some((place, row)) = next else { return Ok(None) };
        let names = self.columns().map_or(
            [
                "time",
                "position",
                "velocity",
                "position on the second axis",
                "velocity on the second axis",
            ],
            |columns| columns.all().map(|column| column.map_or("", |column| column.name)),
        );
        let cells = [
            Some(row.t_s),
            Some(row.position_m),
            row.velocity_mps,
            row.position_y_m,
            row.velocity_y_mps,
        ];
        for (name, value) in names.into_iter().zip(cells) {
            if let Some(value) = value.filter(|value| value.is_nan() || value.abs() > MAX_NUMBER) {
                return Err(MotionError::not_a_number(&self.path, place, name, value));
            }
        }
        if let Some(before) = self.before_s.filter(|&before| row.t_s <= before) {
            let reason = format!("t_s = {} s does not come after {before} s before it", row.t_s);
            return Err(MotionError::at(&self.path, place, reason));
        }
        self.before_s = Some(row.t_s);
        Ok(Some(row))
    }
}

/// What a motion has besides its times.
const MOTION: [Quantity; 4] = [
    Quantity::Position,
    Quantity::Velocity,
    Quantity::PositionY,
    Quantity::VelocityY,
];

impl Source {
    fn of_table(table: Table, notes: &mut Vec<String>) -> Self {
        let values = |quantity: usize| table.values.get(quantity).map_or(&[][..], Vec::as_slice);
        let [positions, velocities, positions_y, velocities_y] = [0, 1, 2, 3].map(values);
        let rows: Vec<(Place, MotionRow)> = (0..table.t_s.len())
            .map(|at| {
                let row = MotionRow {
                    t_s: table.t_s[at],
                    position_m: positions[at],
                    velocity_mps: velocities.get(at).copied(),
                    position_y_m: positions_y.get(at).copied(),
                    velocity_y_mps: velocities_y.get(at).copied().filter(|_| !positions_y.is_empty()),
                };
                (table.places[at], row)
            })
            .collect();
        let has_second_axis = !positions_y.is_empty();
        *notes = table.notes;
        Self::Table {
            rows: rows.into_iter(),
            has_second_axis,
        }
    }
}

impl Iterator for Rows {
    type Item = Result<MotionRow, MotionError>;

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
