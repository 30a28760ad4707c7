//! Motions in recordings of hapticd in Parquet.

use crate::MotionRow;
use crate::columns::{Column, Columns};
use crate::error::{MotionError, Place};
use crate::guard::guarded;
use crate::numbers::{Numbers, NumbersError};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::{Path, PathBuf};

pub(crate) struct ParquetTable {
    path: PathBuf,
    reader: SerializedFileReader<File>,
    columns: Columns,
    next_group: usize,
    group: Option<Group>,
    rows: u64,
}

/// The columns of a group of rows, and those of their cells that have been read.
struct Group {
    readers: Vec<(Column, Numbers)>,
    cells: Vec<Vec<f64>>,
    taken: usize,
}

impl ParquetTable {
    pub(crate) fn new(path: &Path, reader: SerializedFileReader<File>) -> Result<Self, MotionError> {
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        let header: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
        let columns = Columns::find(path, &header.iter().map(String::as_str).collect::<Vec<_>>())?;
        Ok(Self {
            path: path.to_path_buf(),
            reader,
            columns,
            next_group: 0,
            group: None,
            rows: 0,
        })
    }

    pub(crate) fn columns(&self) -> &Columns {
        &self.columns
    }

    pub(crate) fn row(&mut self) -> Result<Option<(Place, MotionRow)>, MotionError> {
        loop {
            if let Some(group) = &mut self.group
                && group.fill(&self.path)?
            {
                self.rows += 1;
                let at = group.taken;
                group.taken += 1;
                let mut cells = group.cells.iter().map(|cells| cells[at]);
                let row = self.columns.row(|_| Ok(cells.next().unwrap_or(f64::NAN)))?;
                return Ok(Some((Place::Row(self.rows), row)));
            }
            if self.next_group == self.reader.num_row_groups() {
                return Ok(None);
            }
            let opened = guarded(|| Group::open(&self.reader, self.next_group, &self.columns));
            self.group = Some(opened.map_err(|error| MotionError::new(&self.path, error))?);
            self.next_group += 1;
        }
    }
}

impl Group {
    fn open(reader: &SerializedFileReader<File>, index: usize, columns: &Columns) -> Result<Self, ParquetError> {
        let group = reader.get_row_group(index)?;
        let readers = columns
            .all()
            .into_iter()
            .flatten()
            .map(|column| Ok((column, Numbers::open(&*group, column.index)?)))
            .collect::<Result<Vec<_>, ParquetError>>()?;
        Ok(Self {
            cells: vec![Vec::new(); readers.len()],
            readers,
            taken: 0,
        })
    }

    /// Reads further cells where all have been taken; says whether there is one.
    fn fill(&mut self, path: &Path) -> Result<bool, MotionError> {
        if self.taken < self.cells[0].len() {
            return Ok(true);
        }
        self.taken = 0;
        for ((column, reader), cells) in self.readers.iter_mut().zip(&mut self.cells) {
            cells.clear();
            reader.read(cells).map_err(|error| match error {
                NumbersError::Type(found) => MotionError::column_type(path, column.name, found),
                NumbersError::Damaged(reason) => MotionError::new(path, reason),
            })?;
        }
        let count = self.cells[0].len();
        if self.cells.iter().any(|cells| cells.len() != count) {
            return Err(MotionError::new(
                path,
                "its columns differ in length: the file is damaged",
            ));
        }
        Ok(count > 0)
    }
}
