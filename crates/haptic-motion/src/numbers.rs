//! Numbers in a column of a Parquet file.

use crate::guard::{Pages, guarded};
use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::RowGroupReader;
use parquet::schema::types::ColumnDescriptor;
use thiserror::Error;

/// Cells read at a time.
const BATCH: usize = 4096;

/// A column of numbers in a group of rows, read some cells at a time. Moments and times of day are in s, decimals are
/// what they stand for.
#[expect(missing_debug_implementations, reason = "the library's reader has none")]
pub struct Numbers {
    reader: ColumnReader,
    meaning: Meaning,
}

/// What the stored numbers of a column stand for, by its logical type or, of an older writer, its converted type.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    /// Themselves.
    Plain,
    /// Whole numbers without a sign.
    Unsigned,
    /// A moment or a time of day; the number of its units in a second.
    Moment(f64),
    /// Digits; the number of those behind the point.
    Decimal(i32),
}

impl Meaning {
    fn of(column: &ColumnDescriptor) -> Self {
        let by_unit = |unit: &TimeUnit| match unit {
            TimeUnit::MILLIS => Self::Moment(1e3),
            TimeUnit::MICROS => Self::Moment(1e6),
            TimeUnit::NANOS => Self::Moment(1e9),
        };
        match (column.logical_type_ref(), column.converted_type()) {
            (Some(LogicalType::Timestamp(moment) | LogicalType::Time(moment)), _) => by_unit(&moment.unit),
            (Some(LogicalType::Decimal(decimal)), _) => Self::Decimal(decimal.scale),
            (Some(LogicalType::Integer(integer)), _) if !integer.is_signed => Self::Unsigned,
            (None, ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS) => by_unit(&TimeUnit::MILLIS),
            (None, ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS) => by_unit(&TimeUnit::MICROS),
            (None, ConvertedType::DECIMAL) => Self::Decimal(column.type_scale()),
            (
                None,
                ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64,
            ) => Self::Unsigned,
            _ => Self::Plain,
        }
    }

    /// What a stored number is divided by: a quotient is rounded once, 5 ms to the number nearest to 0.005.
    fn divisor(self) -> f64 {
        match self {
            Self::Plain | Self::Unsigned => 1.0,
            Self::Moment(per_s) => per_s,
            // Rounded to the nearest number on every machine.
            Self::Decimal(scale) => format!("1e{scale}").parse().unwrap_or(f64::INFINITY),
        }
    }
}

/// Whether a column holds moments or times of day, whose unit its type says: they are read in s, whatever its title
/// says.
#[must_use]
pub fn is_in_seconds(column: &ColumnDescriptor) -> bool {
    matches!(Meaning::of(column), Meaning::Moment(_))
}

/// Why a column is not read.
#[derive(Debug, Error)]
pub enum NumbersError {
    /// It does not hold numbers.
    #[error("of type {0}: numbers expected")]
    Type(&'static str),
    /// The library cannot read it.
    #[error("{0}")]
    Damaged(String),
}

impl Numbers {
    /// Opens a column of a group of rows.
    ///
    /// # Errors
    /// The library's, for example where the file is damaged.
    pub fn open(group: &dyn RowGroupReader, column: usize) -> Result<Self, ParquetError> {
        let chunk = group.metadata().column(column);
        let pages = Pages {
            inner: group.get_column_page_reader(column)?,
            values: chunk.num_values().unsigned_abs(),
        };
        Ok(Self {
            meaning: Meaning::of(chunk.column_descr()),
            reader: get_column_reader(chunk.column_descr_ptr(), Box::new(pages)),
        })
    }

    /// Adds further cells to `cells`, none at the end. An empty one is not a number.
    ///
    /// # Errors
    /// The column holds something else than numbers, or is damaged.
    #[expect(clippy::cast_precision_loss, reason = "a whole number beyond 2^53 is rounded")]
    pub fn read(&mut self, cells: &mut Vec<f64>) -> Result<(), NumbersError> {
        use ColumnReader as Reader;
        let (before, is_unsigned) = (cells.len(), self.meaning == Meaning::Unsigned);
        let is_decimal = matches!(self.meaning, Meaning::Decimal(_));
        let read = match &mut self.reader {
            Reader::DoubleColumnReader(reader) => guarded(|| read(reader, cells, |value| value)),
            Reader::FloatColumnReader(reader) => guarded(|| read(reader, cells, f64::from)),
            Reader::Int32ColumnReader(reader) if is_unsigned => {
                guarded(|| read(reader, cells, |value| f64::from(value.cast_unsigned())))
            }
            Reader::Int32ColumnReader(reader) => guarded(|| read(reader, cells, f64::from)),
            Reader::Int64ColumnReader(reader) if is_unsigned => {
                guarded(|| read(reader, cells, |value| value.cast_unsigned() as f64))
            }
            Reader::Int64ColumnReader(reader) => guarded(|| read(reader, cells, |value| value as f64)),
            Reader::ByteArrayColumnReader(reader) if is_decimal => {
                guarded(|| read(reader, cells, |value| whole(value.data())))
            }
            Reader::FixedLenByteArrayColumnReader(reader) if is_decimal => {
                guarded(|| read(reader, cells, |value| whole(value.data())))
            }
            Reader::BoolColumnReader(_) => return Err(NumbersError::Type("boolean")),
            Reader::Int96ColumnReader(_) => return Err(NumbersError::Type("int96")),
            Reader::ByteArrayColumnReader(_) => return Err(NumbersError::Type("text")),
            Reader::FixedLenByteArrayColumnReader(_) => return Err(NumbersError::Type("bytes")),
        };
        let divisor = self.meaning.divisor();
        cells[before..].iter_mut().for_each(|cell| *cell /= divisor);
        read.map_err(NumbersError::Damaged)
    }
}

/// The whole number of a decimal: two's complement, the highest byte first.
fn whole(bytes: &[u8]) -> f64 {
    let sign = if bytes.first().is_some_and(|first| *first >= 0x80) {
        -1.0
    } else {
        0.0
    };
    bytes.iter().fold(sign, |high, byte| 256.0 * high + f64::from(*byte))
}

/// Reads a batch of cells.
fn read<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    cells: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let (rows, read, _) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
    let mut numbers = values.into_iter().map(number);
    if read == rows {
        cells.extend(numbers);
        return Ok(());
    }
    // Levels are given where a cell may be empty; the highest is that of a cell that is not.
    let full = levels.iter().max().copied().unwrap_or(0).max(1);
    cells.extend(levels.iter().map(|level| {
        let is_full = *level == full;
        is_full.then(|| numbers.next()).flatten().unwrap_or(f64::NAN)
    }));
    Ok(())
}
