//! Motions in recordings of hapticd in CSV.

use crate::Row;
use crate::columns::{Column, Columns};
use crate::error::{MotionError, Place};
use crate::opened::Input;
use crate::whole_lines::WholeLines;
use std::path::{Path, PathBuf};

/// The first bytes of a recording of hapticd in CSV.
pub(crate) const RECORDING_TITLE: &[u8] = b"# hapticd recording ";

pub(crate) struct CsvTable {
    path: PathBuf,
    reader: csv::Reader<WholeLines<Input>>,
    record: csv::StringRecord,
    header: csv::StringRecord,
    columns: Columns,
}

impl CsvTable {
    pub(crate) fn new(path: &Path, input: Input) -> Result<Self, MotionError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .flexible(true)
            .from_reader(WholeLines::new(input));
        let header = reader
            .headers()
            .map_err(|error| MotionError::format(path, error))?
            .clone();
        let columns = Columns::find(path, &header.iter().collect::<Vec<_>>())?;
        Ok(Self {
            path: path.to_path_buf(),
            reader,
            record: csv::StringRecord::new(),
            header,
            columns,
        })
    }

    pub(crate) fn columns(&self) -> &Columns {
        &self.columns
    }

    pub(crate) fn row(&mut self) -> Result<Option<(Place, Row)>, MotionError> {
        let read = self.reader.read_record(&mut self.record);
        if !read.map_err(|error| MotionError::format(&self.path, error))? {
            return Ok(None);
        }
        let line = self.record.position().map_or(0, csv::Position::line);
        self.check_length(line)?;
        let place = Place::Line(line);
        let number = |column: &Column| {
            let text = self.record.get(column.index).unwrap_or_default();
            text.parse::<f64>()
                .map_err(|_| MotionError::not_a_number(&self.path, place, column.name, text))
        };
        let row = Row {
            t_s: number(&self.columns.time)?,
            position_m: number(&self.columns.position)?,
            velocity_mps: self.columns.velocity.as_ref().map(number).transpose()?,
        };
        Ok(Some((place, row)))
    }

    fn check_length(&self, line: u64) -> Result<(), MotionError> {
        let (cells, columns) = (self.record.len(), self.header.len());
        if cells < columns {
            let missing: Vec<&str> = self.header.iter().skip(cells).collect();
            return Err(MotionError::ShortRow {
                path: self.path.clone(),
                line,
                cells,
                columns,
                missing: missing.join(", "),
            });
        }
        if cells > columns {
            return Err(MotionError::LongRow {
                path: self.path.clone(),
                line,
                cells,
                columns,
            });
        }
        Ok(())
    }
}
