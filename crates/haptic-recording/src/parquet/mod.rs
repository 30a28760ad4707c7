//! Parquet (<https://parquet.apache.org/docs/file-format>), which pandas, DuckDB, R and MATLAB read.
//!
//! - A column for each of a row's, named as there. Whole numbers are `INTEGER(64, unsigned)`,
//!   `INTEGER(32, unsigned)` and, for `contact`, `INTEGER(8, signed)`; the others are `DOUBLE`, and
//!   `state` is a `STRING`. None is ever null.
//! - Numbers are stored as they compress best: `BYTE_STREAM_SPLIT` for `DOUBLE`,
//!   `DELTA_BINARY_PACKED` for whole numbers. Only `state` has a dictionary, and the positions of
//!   the device while they are few: an encoder's recur. Pages are compressed as `LZ4_RAW`. In a set of many recordings
//!   `DOUBLE` is `PLAIN`, because Spark's own reader refuses `BYTE_STREAM_SPLIT` (SPARK-56894).
//! - The footer's key-value metadata have `hapticd.version`, each field of the [`Metadata`] as
//!   `hapticd.` and its name (`server`, `device` and `notes` are texts, the others JSON), and
//!   `hapticd.marks`: a JSON array of `[rows before it, mark]`.
//!
//! Nobody reads a Parquet file without its footer, which comes last. So a recording in the making is
//! an MCAP file beside it, `NAME.parquet.partial.mcap`, which outlives whatever kills its writer;
//! `NAME.parquet` itself is empty meanwhile. At the end the rows go over and the MCAP file is
//! deleted. As long as it is there it is the recording, and is read in the place of the other.

mod reader;
mod spool;
mod writer;

pub(super) use reader::Reader;
pub(super) use spool::Spool;
pub(super) use writer::{Numbers, Writer};

use crate::columns::Kind;

#[cfg(doc)]
use crate::metadata::Metadata;

pub(super) use haptic_motion::PARQUET_MAGIC as MAGIC;
pub use haptic_motion::RECORDING_KEY as KEY;
pub(super) use haptic_motion::spool_of;

/// Key of the marks.
const MARKS: &str = "hapticd.marks";

/// Type of a column, as in a schema.
const fn type_of(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::U64 => ("INT64", "(INTEGER(64,false))"),
        Kind::U32 => ("INT32", "(INTEGER(32,false))"),
        Kind::F64 => ("DOUBLE", ""),
        Kind::Contact => ("INT32", "(INTEGER(8,true))"),
        Kind::State => ("BYTE_ARRAY", "(STRING)"),
    }
}
