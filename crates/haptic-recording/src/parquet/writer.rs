//! Writes Parquet, a group of rows at a time.

use super::{KEY, MARKS, type_of};
use crate::columns::{Column, Kind, STATES, columns};
use crate::mark::Mark;
use crate::metadata::{Metadata, to_fields};
use crate::rows::Rows;
use crate::writer::Sink;
use haptic_ipc::{Sample, SampleY};
use parquet::basic::{Compression, Encoding};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::ColumnPath;
use std::io::{self, Write};
use std::sync::Arc;

/// Rows of a group: two minutes at 1 kHz, 20 MB in memory.
const GROUP: usize = 1 << 17;

/// Columns that come from an encoder, whose positions recur: a group has some thousands of them.
const ENCODED: [&str; 4] = [
    "device_position_m",
    "sample_position_m",
    "device_position_y_m",
    "sample_position_y_m",
];

/// Largest dictionary of those, bytes: with more positions than it holds a dictionary gains nothing.
const DICTIONARY: usize = 1 << 18;

/// How floating-point numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// As they compress best.
    Small,
    /// As every reader knows them.
    Plain,
}

/// Writes rows and marks. Nothing of it can be read before its end.
pub(crate) struct Writer<W: Write + Send> {
    file: SerializedFileWriter<W>,
    columns: &'static [Column],
    group: Vec<Sample>,
    /// What each of them has of a second axis.
    group_y: Vec<SampleY>,
    rows: u64,
    marks: Vec<(u64, Mark)>,
}

impl<W: Write + Send> Writer<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// `out` cannot be written to.
    pub(crate) fn new(out: W, metadata: &Metadata, numbers: Numbers) -> io::Result<Self> {
        let columns = columns(metadata.axes);
        let fields = columns.iter().map(|column| {
            let (physical, logical) = type_of(column.kind);
            format!("REQUIRED {physical} {} {logical};", column.name)
        });
        let schema = format!("message sample {{ {} }}", fields.collect::<String>());
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::LZ4_RAW)
            .set_dictionary_enabled(false)
            // The least and the most of a group, by which readers pass over groups.
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_created_by(concat!("hapticd ", env!("CARGO_PKG_VERSION")).to_owned());
        for column in columns {
            let path = ColumnPath::from(column.name);
            properties = match column.kind {
                Kind::F64 => {
                    let encoding = match numbers {
                        Numbers::Small => Encoding::BYTE_STREAM_SPLIT,
                        Numbers::Plain => Encoding::PLAIN,
                    };
                    properties.set_column_encoding(path.clone(), encoding)
                }
                Kind::State => properties.set_column_dictionary_enabled(path.clone(), true),
                _ => properties.set_column_encoding(path.clone(), Encoding::DELTA_BINARY_PACKED),
            };
            if ENCODED.contains(&column.name) {
                properties = properties
                    .set_column_dictionary_enabled(path.clone(), true)
                    .set_column_dictionary_page_size_limit(path, DICTIONARY);
            }
        }
        let schema = Arc::new(parse_message_type(&schema).map_err(io_error)?);
        let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties.build())).map_err(io_error)?;
        for (name, text) in to_fields(metadata)? {
            file.append_key_value_metadata(KeyValue::new(format!("{KEY}{name}"), text));
        }
        Ok(Self {
            file,
            columns,
            group: Vec::with_capacity(GROUP),
            group_y: Vec::new(),
            rows: 0,
            marks: Vec::new(),
        })
    }
}

impl<W: Write + Send> Sink for Writer<W> {
    fn rows(&mut self, mut rows: Rows<'_>) -> io::Result<()> {
        self.rows += rows.samples.len() as u64;
        while !rows.samples.is_empty() {
            let (now, later) = rows.split_at(rows.samples.len().min(GROUP - self.group.len()));
            self.group.extend_from_slice(now.samples);
            self.group_y.extend_from_slice(now.ys);
            rows = later;
            if self.group.len() == GROUP {
                self.end_group()?;
            }
        }
        Ok(())
    }

    fn mark(&mut self, mark: &Mark) -> io::Result<()> {
        self.marks.push((self.rows, mark.clone()));
        Ok(())
    }

    /// A group of rows is written whole.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.file.bytes_written() as u64
    }

    /// Writes the footer.
    fn finish(mut self: Box<Self>) -> io::Result<u64> {
        self.end_group()?;
        let marks = serde_json::to_string(&self.marks)?;
        self.file
            .append_key_value_metadata(KeyValue::new(MARKS.to_owned(), marks));
        self.file.finish().map_err(io_error)?;
        Ok(self.file.bytes_written() as u64)
    }
}

impl<W: Write + Send> Writer<W> {
    fn end_group(&mut self) -> io::Result<()> {
        if self.group.is_empty() {
            return Ok(());
        }
        let group_rows = Rows {
            samples: &self.group,
            ys: &self.group_y,
        };
        let mut group = self.file.next_row_group().map_err(io_error)?;
        for column in self.columns {
            let mut writer = group
                .next_column()
                .map_err(io_error)?
                .ok_or_else(|| io::Error::other("the schema has fewer columns than a row"))?;
            write(&mut writer, column, group_rows).map_err(io_error)?;
            writer.close().map_err(io_error)?;
        }
        group.close().map_err(io_error)?;
        self.group.clear();
        self.group_y.clear();
        Ok(())
    }
}

fn write(writer: &mut SerializedColumnWriter<'_>, column: &Column, rows: Rows<'_>) -> Result<(), ParquetError> {
    let bits = rows.iter().map(|(row, y)| column.bits(row, y));
    match column.kind {
        Kind::U64 => {
            let values: Vec<i64> = bits.map(u64::cast_signed).collect();
            writer.typed::<Int64Type>().write_batch(&values, None, None)?;
        }
        Kind::F64 => {
            let values: Vec<f64> = bits.map(f64::from_bits).collect();
            writer.typed::<DoubleType>().write_batch(&values, None, None)?;
        }
        Kind::U32 | Kind::Contact => {
            #[expect(clippy::cast_possible_truncation, reason = "they have 32 bits, or 8")]
            let value = |bits: u64| match column.kind {
                Kind::Contact => (bits as u8).cast_signed().into(),
                _ => (bits as u32).cast_signed(),
            };
            let values: Vec<i32> = bits.map(value).collect();
            writer.typed::<Int32Type>().write_batch(&values, None, None)?;
        }
        Kind::State => {
            let names = STATES.map(|name| ByteArray::from(name.as_bytes().to_vec()));
            let place = |bits| usize::try_from(bits).unwrap_or_default();
            let values: Vec<ByteArray> = bits.map(|bits| names[place(bits)].clone()).collect();
            writer.typed::<ByteArrayType>().write_batch(&values, None, None)?;
        }
    }
    Ok(())
}

/// The system's own error, where it was one.
fn io_error(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(error) => match error.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(error) => io::Error::other(error),
        },
        error => io::Error::other(error),
    }
}
