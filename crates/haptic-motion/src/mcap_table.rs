//! Motions in MCAP: a channel of fixed structs.

use crate::Row;
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

/// The bytes before a message in CDR, which say how it is encoded.
const CDR_HEADER: usize = 4;

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
                return Err(MotionError::MissingColumn {
                    path: path.to_path_buf(),
                    column: TIME,
                    header: names.join(","),
                });
            };
            match record {
                Record::Schema { header, data } if header.encoding == "ros2msg" => {
                    // The summary at the end has all of them again.
                    schemas.entry(header.id).or_insert_with(|| {
                        let fields = fields(&String::from_utf8_lossy(&data));
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

    pub(crate) fn row(&mut self) -> Result<Option<(Place, Row)>, MotionError> {
        while let Some(record) = next_record(&self.path, &mut self.reader, &mut self.input)? {
            let Record::Message { header, data } = record else {
                continue;
            };
            if header.channel_id != self.channel {
                continue;
            }
            self.rows += 1;
            let place = Place::Row(self.rows);
            let number = |column: &Column| self.fields[column.index].number(&self.path, column, place, &data);
            let row = Row {
                t_s: number(&self.columns.time)?,
                position_m: number(&self.columns.position)?,
                velocity_mps: self.columns.velocity.as_ref().map(number).transpose()?,
            };
            return Ok(Some((place, row)));
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
                    .map_err(|source| MotionError::open(path, source))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                let record = mcap::parse_record(opcode, data).map_err(|error| MotionError::format(path, error))?;
                return Ok(Some(record.into_owned()));
            }
            Err(McapError::UnexpectedEof) => return Ok(None),
            Err(McapError::UnsupportedCompression(codec)) => {
                let reason = format!(
                    "its chunks are compressed by {codec}, which is not read here: write it without compression"
                );
                return Err(MotionError::format(path, reason));
            }
            Err(error) => return Err(MotionError::format(path, error)),
        }
    }
    Ok(None)
}

/// A field of a message, up to the first whose place depends on what the message holds.
#[derive(Clone, Debug)]
struct Field {
    name: String,
    kind: String,
    /// Its place in the message after the header, bytes.
    offset: usize,
}

/// The fields of a schema in the language of ROS 2: a type and a name in each line. CDR places each
/// at a multiple of its size.
fn fields(schema: &str) -> Vec<Field> {
    let mut fields = Vec::new();
    let mut end = 0_usize;
    for line in schema.lines() {
        let text = line.split('#').next().unwrap_or_default().trim();
        // Other types follow, which this one uses.
        if text.starts_with("===") {
            break;
        }
        let mut words = text.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else {
            continue;
        };
        // A constant has no place in a message.
        if text.contains('=') {
            continue;
        }
        let size = match kind {
            "bool" | "byte" | "char" | "int8" | "uint8" => 1,
            "int16" | "uint16" => 2,
            "int32" | "uint32" | "float32" => 4,
            "int64" | "uint64" | "float64" => 8,
            _ => break,
        };
        let offset = end.next_multiple_of(size);
        fields.push(Field {
            name: name.to_owned(),
            kind: kind.to_owned(),
            offset,
        });
        end = offset + size;
    }
    fields
}

impl Field {
    fn number(&self, path: &Path, column: &Column, place: Place, message: &[u8]) -> Result<f64, MotionError> {
        let broken = |what: &str| MotionError::format(path, format!("{place}: {what}"));
        let is_little_endian = match message.get(..CDR_HEADER) {
            Some([0, 1, ..]) => true,
            Some([0, 0, ..]) => false,
            _ => return Err(broken("the message is not in CDR")),
        };
        let bytes = &message[CDR_HEADER..];
        let cut = || broken("the message is shorter than its schema says");
        match self.kind.as_str() {
            "float64" => {
                let bytes = *bytes.get(self.offset..).and_then(<[u8]>::first_chunk).ok_or_else(cut)?;
                Ok(if is_little_endian {
                    f64::from_le_bytes(bytes)
                } else {
                    f64::from_be_bytes(bytes)
                })
            }
            "float32" => {
                let bytes = *bytes.get(self.offset..).and_then(<[u8]>::first_chunk).ok_or_else(cut)?;
                Ok(f64::from(if is_little_endian {
                    f32::from_le_bytes(bytes)
                } else {
                    f32::from_be_bytes(bytes)
                }))
            }
            other => Err(MotionError::ColumnType {
                path: path.to_path_buf(),
                column: column.name,
                found: other.to_owned(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_gives_each_field_its_place() {
        let schema = "# a motion\nuint8 state # of the rig\nuint8 IDLE=0\n\nfloat64 t_s\nfloat32 position_m 0.0\n\
                      uint16 flags\nstring name\nfloat64 late\n===\nMSG: other/Type\nfloat64 x\n";
        let found: Vec<(String, usize)> = fields(schema)
            .into_iter()
            .map(|field| (field.name, field.offset))
            .collect();
        let wanted = [("state", 0), ("t_s", 8), ("position_m", 16), ("flags", 20)];
        assert_eq!(found, wanted.map(|(name, offset)| (name.to_owned(), offset)));
    }
}
