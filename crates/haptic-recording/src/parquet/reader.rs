//! Reads Parquet, some rows at a time.

use super::{KEY, MAGIC, MARKS, type_of};
use crate::columns::{self, Column, Kind, STATES};
use crate::error::{Ending, Place, RecordingError};
use crate::mark::{Entry, Mark};
use crate::metadata::{Metadata, from_fields};
use crate::reader::Source;
use haptic_ipc::{Sample, SampleY};
use haptic_motion::guard::{Pages, guarded};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::Result;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use std::collections::VecDeque;

/// Rows read at once.
const BATCH: usize = 4096;

/// A Parquet recording, read some rows at a time.
pub(crate) struct Reader {
    file: Box<dyn FileReader>,
    metadata: Metadata,
    marks: VecDeque<(u64, Mark)>,
    /// Place of each of our columns among those of the file.
    columns: Vec<(usize, &'static Column)>,
    /// The group that is read, and its rows that are left.
    group: usize,
    left: usize,
    /// Rows before the end of that group.
    group_end: u64,
    open: Vec<ColumnReader>,
    /// Rows that were read and are not handed out, the next one last.
    rows: Vec<(Sample, SampleY)>,
    handed: u64,
    is_complete: bool,
    ending: Option<Ending>,
}

impl Reader {
    /// Reads the footer.
    ///
    /// # Errors
    /// The file lacks its footer, is not a recording of hapticd, or has another version.
    pub(crate) fn new<R: ChunkReader + 'static>(input: R) -> std::result::Result<Self, RecordingError> {
        let place = Place::Byte(input.len());
        let is_whole = guarded(|| input.get_bytes(input.len().saturating_sub(4), 4));
        if !is_whole.is_ok_and(|end| end == MAGIC) {
            let reason = "a Parquet file without its footer, which comes last: nothing of it can be read";
            return Err(RecordingError::at(place, reason));
        }
        let file = guarded(|| SerializedFileReader::new(input));
        let file = file.map_err(|reason| RecordingError::at(place, reason))?;
        let pairs = file.metadata().file_metadata().key_value_metadata();
        let ours = pairs
            .into_iter()
            .flatten()
            .filter_map(|pair| Some((pair.key.strip_prefix(KEY)?, pair.value.as_deref()?)));
        let fields: Vec<(&str, &str)> = ours.collect();
        if fields.is_empty() {
            return Err(RecordingError::OtherProgram {
                format: "Parquet",
                lacking: format!("the keys `{KEY}*`"),
            });
        }
        let (marks, fields): (Vec<_>, Vec<_>) = fields.into_iter().partition(|(name, _)| MARKS.ends_with(name));
        let metadata = from_fields(place, fields)?;
        let marks = marks_of(marks.first().map_or("[]", |(_, text)| text))
            .map_err(|error| RecordingError::metadata(place, error))?;
        let columns = columns_of(&file, metadata.axes)?;
        Ok(Self {
            is_complete: marks.iter().any(|(_, mark)| matches!(mark, Mark::End { .. })),
            file: Box::new(file),
            metadata,
            marks,
            columns,
            group: 0,
            left: 0,
            group_end: 0,
            open: Vec::new(),
            rows: Vec::new(),
            handed: 0,
            ending: None,
        })
    }
}

impl Source for Reader {
    fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    fn rows_read(&self) -> Option<(u64, u64)> {
        let rows = self.file.metadata().file_metadata().num_rows();
        Some((self.handed, u64::try_from(rows).unwrap_or(0)))
    }

    fn ending(&self) -> Option<Ending> {
        self.ending
    }

    fn entry(&mut self) -> std::result::Result<Option<Entry>, RecordingError> {
        if self.ending.is_some() {
            return Ok(None);
        }
        if let Some((_, mark)) = self.marks.pop_front_if(|(rows, _)| *rows <= self.handed) {
            return Ok(Some(Entry::Mark(mark)));
        }
        if self.rows.is_empty() {
            let place = Place::Row(self.handed + 1);
            guarded(|| self.next_rows())
                .and_then(std::convert::identity)
                .map_err(|reason| {
                    // Reading continues with the next group.
                    self.rows.clear();
                    (self.left, self.handed) = (0, self.group_end);
                    RecordingError::at(place, reason)
                })?;
        }
        if let Some((row, y)) = self.rows.pop() {
            self.handed += 1;
            return Ok(Some(Entry::Row(row, (self.metadata.axes == 2).then_some(y))));
        }
        // Marks that stand behind rows that are not there.
        if let Some((_, mark)) = self.marks.pop_front() {
            return Ok(Some(Entry::Mark(mark)));
        }
        self.ending = Some(if self.is_complete {
            Ending::Complete
        } else {
            Ending::Open
        });
        Ok(None)
    }
}

impl Reader {
    /// Reads the next rows; none at the end.
    fn next_rows(&mut self) -> Result<std::result::Result<(), String>> {
        while self.left == 0 {
            if self.group == self.file.num_row_groups() {
                return Ok(Ok(()));
            }
            let group = self.group;
            self.group += 1;
            let group = self.file.get_row_group(group)?;
            let values = u64::try_from(group.metadata().num_rows())?;
            self.group_end = self.group_end.saturating_add(values);
            self.open.clear();
            for (index, _) in &self.columns {
                let inner = group.get_column_page_reader(*index)?;
                let pages = Box::new(Pages { inner, values });
                let description = group.metadata().column(*index).column_descr_ptr();
                self.open.push(get_column_reader(description, pages));
            }
            self.left = usize::try_from(values)?;
        }
        let count = self.left.min(BATCH);
        self.left -= count;
        self.rows.resize(count, (Sample::default(), SampleY::default()));
        for (cells, (_, column)) in self.open.iter_mut().zip(&self.columns) {
            let bits = read_bits(cells, count)?;
            if bits.len() != count {
                return Ok(Err(format!("{} has {} of {count} rows", column.name, bits.len())));
            }
            for ((row, y), bits) in self.rows.iter_mut().rev().zip(bits) {
                // A small number as a large one, with its sign.
                let is_contact = column.kind == Kind::Contact;
                let bits = bits
                    ^ if is_contact && bits >= 0xffff_ff80 {
                        0xffff_ff00
                    } else {
                        0
                    };
                if !column.set(row, y, bits) {
                    return Ok(Err(format!("{} = {bits} is out of range", column.name)));
                }
            }
        }
        Ok(Ok(()))
    }
}

/// Reads `count` cells, or those that are left, as bits.
fn read_bits(reader: &mut ColumnReader, count: usize) -> Result<Vec<u64>> {
    fn values<T: DataType>(reader: &mut ColumnReaderImpl<T>, count: usize) -> Result<Vec<T::T>> {
        let mut values = Vec::with_capacity(count);
        // A column that another program wrote may allow for nulls; one that has some is short here.
        let mut levels = Vec::new();
        reader.read_records(count, Some(&mut levels), None, &mut values)?;
        Ok(values)
    }
    Ok(match reader {
        ColumnReader::Int64ColumnReader(reader) => values(reader, count)?.into_iter().map(i64::cast_unsigned).collect(),
        ColumnReader::DoubleColumnReader(reader) => values(reader, count)?.into_iter().map(f64::to_bits).collect(),
        ColumnReader::Int32ColumnReader(reader) => {
            let values = values(reader, count)?.into_iter();
            values.map(|value| value.cast_unsigned().into()).collect()
        }
        ColumnReader::ByteArrayColumnReader(reader) => values(reader, count)?.iter().map(state).collect(),
        // No column of ours is of such a type.
        _ => Vec::new(),
    })
}

/// Place of a state; beyond the last one where it is none.
fn state(name: &ByteArray) -> u64 {
    STATES
        .iter()
        .position(|state| state.as_bytes() == name.data())
        .unwrap_or(STATES.len()) as u64
}

/// The marks of this version.
fn marks_of(text: &str) -> serde_json::Result<VecDeque<(u64, Mark)>> {
    let all: Vec<(u64, serde_json::Value)> = serde_json::from_str(text)?;
    let known = all.into_iter().filter_map(|(rows, mark)| {
        Mark::from_json(mark.to_string().as_bytes())
            .map(|mark| mark.map(|mark| (rows, mark)))
            .transpose()
    });
    known.collect()
}

fn columns_of<R: ChunkReader + 'static>(
    file: &SerializedFileReader<R>,
    axes: u8,
) -> std::result::Result<Vec<(usize, &'static Column)>, RecordingError> {
    let schema = file.metadata().file_metadata().schema_descr();
    let known = columns::columns(axes);
    let mut columns = Vec::with_capacity(known.len());
    for (index, column) in known.iter().enumerate() {
        let failed = |found: &str| RecordingError::column(Place::Row(0), index + 1, column.name, found);
        let found = (0..schema.num_columns()).find(|found| schema.column(*found).path().string() == column.name);
        let found = found.ok_or_else(|| failed(""))?;
        let description = schema.column(found);
        let physical = description.physical_type().to_string();
        if physical != type_of(column.kind).0 || description.max_rep_level() > 0 {
            return Err(failed(&format!("{physical} {}", column.name)));
        }
        columns.push((found, column));
    }
    Ok(columns)
}
