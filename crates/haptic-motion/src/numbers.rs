//! Numbers in a column of a Parquet file.

use crate::guard::{Pages, guarded};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::RowGroupReader;
use thiserror::Error;

/// Cells read at a time.
const BATCH: usize = 4096;

/// A column of numbers in a group of rows, read some cells at a time.
#[expect(missing_debug_implementations, reason = "the library's reader has none")]
pub struct Numbers {
    reader: ColumnReader,
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
        let reader = get_column_reader(chunk.column_descr_ptr(), Box::new(pages));
        Ok(Self { reader })
    }

    /// Adds further cells to `cells`, none at the end. Gives the place among them of the first that is empty.
    ///
    /// # Errors
    /// The column holds something else than numbers, or is damaged.
    #[expect(clippy::cast_precision_loss, reason = "a whole number beyond 2^53 is rounded")]
    pub fn read(&mut self, cells: &mut Vec<f64>) -> Result<Option<usize>, NumbersError> {
        let read = match &mut self.reader {
            ColumnReader::DoubleColumnReader(reader) => guarded(|| read(reader, cells, |value| value)),
            ColumnReader::FloatColumnReader(reader) => guarded(|| read(reader, cells, f64::from)),
            ColumnReader::Int32ColumnReader(reader) => guarded(|| read(reader, cells, f64::from)),
            ColumnReader::Int64ColumnReader(reader) => guarded(|| read(reader, cells, |value| value as f64)),
            ColumnReader::BoolColumnReader(_) => return Err(NumbersError::Type("boolean")),
            ColumnReader::Int96ColumnReader(_) => return Err(NumbersError::Type("int96")),
            ColumnReader::ByteArrayColumnReader(_) | ColumnReader::FixedLenByteArrayColumnReader(_) => {
                return Err(NumbersError::Type("text"));
            }
        };
        read.map_err(NumbersError::Damaged)
    }
}

/// Reads a batch of cells. Gives the place in the batch of the first that is empty.
fn read<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    cells: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<Option<usize>, ParquetError> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let (rows, read, _) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
    cells.extend(values.into_iter().map(number));
    // Levels are given where a cell may be empty; the highest is that of a cell that is not.
    let full = levels.iter().max().copied().unwrap_or(0);
    Ok((read < rows).then(|| levels.iter().position(|level| *level < full.max(1)).unwrap_or(0)))
}
