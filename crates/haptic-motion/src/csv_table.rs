//! Motions in recordings of hapticd in CSV.

use crate::MotionRow;
use crate::columns::{Column, Columns};
use crate::error::{MotionError, Place};
use crate::opened::Input;
use std::cmp::Ordering;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

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
        let header = reader.headers().map_err(|error| MotionError::new(path, error))?.clone();
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

    pub(crate) fn row(&mut self) -> Result<Option<(Place, MotionRow)>, MotionError> {
        let read = self.reader.read_record(&mut self.record);
        if !read.map_err(|error| MotionError::new(&self.path, error))? {
            return Ok(None);
        }
        let place = Place::Line(self.record.position().map_or(0, csv::Position::line));
        self.check_length(place)?;
        let number = |column: &Column| {
            let text = self.record.get(column.index).unwrap_or_default();
            text.parse::<f64>()
                .map_err(|_| MotionError::not_a_number(&self.path, place, column.name, text))
        };
        Ok(Some((place, self.columns.row(number)?)))
    }

    fn check_length(&self, place: Place) -> Result<(), MotionError> {
        let (cells, columns) = (self.record.len(), self.header.len());
        let reason = match cells.cmp(&columns) {
            Ordering::Equal => return Ok(()),
            Ordering::Less => {
                let missing: Vec<&str> = self.header.iter().skip(cells).collect();
                format!("{cells} of {columns} cells, and none for {}", missing.join(", "))
            }
            Ordering::Greater => format!("{cells} cells, and the header {columns} columns"),
        };
        Err(MotionError::at(&self.path, place, format_args!("the row has {reason}")))
    }
}

/// Bytes read at a time.
const CHUNK: usize = 1 << 16;

/// Longest line, bytes: a damaged file is not read into memory whole.
const MAX_LINE: usize = 1 << 20;

/// Reads a text up to its last newline: its writer may have died in the middle of a line.
pub(crate) struct WholeLines<R> {
    input: R,
    ready: Vec<u8>,
    taken: usize,
    /// The beginning of a line whose end has not been read.
    partial: Vec<u8>,
}

impl<R: Read> WholeLines<R> {
    pub(crate) fn new(input: R) -> Self {
        Self {
            input,
            ready: Vec::new(),
            taken: 0,
            partial: Vec::new(),
        }
    }
}

impl<R: Read> Read for WholeLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.ready.len() {
            let begun = self.partial.len();
            if begun > MAX_LINE {
                return Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    format!("a line is longer than {MAX_LINE} bytes: the file is damaged"),
                ));
            }
            let mut chunk = std::mem::take(&mut self.partial);
            chunk.resize(begun + CHUNK, 0);
            let read = self.input.read(&mut chunk[begun..])?;
            if read == 0 {
                return Ok(0);
            }
            chunk.truncate(begun + read);
            let whole = chunk.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
            self.partial = chunk.split_off(whole);
            (self.ready, self.taken) = (chunk, 0);
        }
        let count = buffer.len().min(self.ready.len() - self.taken);
        buffer[..count].copy_from_slice(&self.ready[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}
