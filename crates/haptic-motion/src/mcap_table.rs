//! Motions in MCAP: a channel of fixed structs.

use crate::MotionRow;
use crate::cdr::{self, Field};
use crate::columns::{Column, Columns, TIME};
use crate::error::{MotionError, Place};
use crate::opened::Input;
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Bytes read at a time.
const CHUNK: usize = 1 << 16;

/// Longest record, bytes: a damaged file is not read into memory whole.
const MAX_RECORD: usize = 1 << 24;

pub(crate) struct McapTable {
    path: PathBuf,
    input: Input,
    reader: LinearReader,
    channel: u16,
    fields: Vec<Field>,
    columns: Columns,
    rows: u64,
}

impl McapTable {
    pub(crate) fn new(path: &Path, mut input: Input) -> Result<Self, MotionError> {
        let options = LinearReaderOptions::default()
            // A file that was broken off lacks it.
            .with_skip_end_magic(true)
            .with_record_length_limit(MAX_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        let mut schemas: HashMap<u16, Vec<Field>> = HashMap::new();
        let mut names = Vec::new();
        loop {
            let record = next_record(path, &mut reader, &mut input)?;
            let Some(record) = record else {
                return Err(MotionError::missing_column(path, TIME, &names.join(",")));
            };
            match record {
                Record::Schema { header, data } if header.encoding == "ros2msg" => {
                    // The summary at the end has all of them again.
                    schemas.entry(header.id).or_insert_with(|| {
                        let (fields, _) = cdr::fields(&String::from_utf8_lossy(&data));
                        names.extend(fields.iter().map(|field| field.name.clone()));
                        fields
                    });
                }
                Record::Channel(channel) if channel.message_encoding == "cdr" => {
                    let is_motion = |fields: &&Vec<Field>| fields.iter().any(|field| field.name == TIME);
                    let Some(fields) = schemas.get(&channel.schema_id).filter(is_motion).cloned() else {
                        continue;
                    };
                    let header: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
                    return Ok(Self {
                        path: path.to_path_buf(),
                        channel: channel.id,
                        columns: Columns::find(path, &header)?,
                        fields,
                        input,
                        reader,
                        rows: 0,
                    });
                }
                _ => {}
            }
        }
    }

    pub(crate) fn columns(&self) -> &Columns {
        &self.columns
    }

    pub(crate) fn row(&mut self) -> Result<Option<(Place, MotionRow)>, MotionError> {
        while let Some(record) = next_record(&self.path, &mut self.reader, &mut self.input)? {
            let Record::Message { header, data } = record else {
                continue;
            };
            if header.channel_id != self.channel {
                continue;
            }
            self.rows += 1;
            let place = Place::Row(self.rows);
            let cell = |column: &Column| number(&self.fields[column.index], &self.path, column, place, &data);
            return Ok(Some((place, self.columns.row(cell)?)));
        }
        Ok(None)
    }
}

/// The next record; none at the end, or where the file was broken off.
fn next_record(
    path: &Path,
    reader: &mut LinearReader,
    input: &mut Input,
) -> Result<Option<Record<'static>>, MotionError> {
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(bytes)) => {
                let read = input
                    .read(reader.insert(bytes.max(CHUNK)))
                    .map_err(|source| MotionError::new(path, source))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                let record = mcap::parse_record(opcode, data).map_err(|error| MotionError::new(path, error))?;
                return Ok(Some(record.into_owned()));
            }
            Err(McapError::UnexpectedEof) => return Ok(None),
            Err(McapError::UnsupportedCompression(codec)) => {
                let reason = format!(
                    "its chunks are compressed by {codec}, which is not read here: write it without compression"
                );
                return Err(MotionError::new(path, reason));
            }
            Err(error) => return Err(MotionError::new(path, error)),
        }
    }
    Ok(None)
}

/// The number in a field of a message.
fn number(field: &Field, path: &Path, column: &Column, place: Place, message: &[u8]) -> Result<f64, MotionError> {
    let broken = |what: &str| MotionError::new(path, format!("{place}: {what}"));
    let is_little_endian = match message.get(..cdr::HEADER) {
        Some([0, 1, ..]) => true,
        Some([0, 0, ..]) => false,
        _ => return Err(broken("the message is not in CDR")),
    };
    let at = message.get(cdr::HEADER + field.offset..).unwrap_or_default();
    let number = match (field.kind.as_str(), is_little_endian) {
        ("float64", true) => at.first_chunk().copied().map(f64::from_le_bytes),
        ("float64", false) => at.first_chunk().copied().map(f64::from_be_bytes),
        ("float32", true) => at.first_chunk().copied().map(f32::from_le_bytes).map(f64::from),
        ("float32", false) => at.first_chunk().copied().map(f32::from_be_bytes).map(f64::from),
        (other, _) => return Err(MotionError::column_type(path, column.name, other)),
    };
    number.ok_or_else(|| broken("the message is shorter than its schema says"))
}
