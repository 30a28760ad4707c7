//! MCAP (<https://mcap.dev/spec>), which Foxglove, Lichtblick, PlotJuggler and Python's `mcap` open.
//!
//! - A Metadata record `hapticd recording` comes first: `version`, and each field of the
//!   [`Metadata`]; `server`, `device` and `notes` are texts, the others JSON.
//! - Channel `/hapticd/samples` has the rows: message encoding `cdr`, schema `hapticd/msg/Sample` in
//!   `ros2msg`. A message is a struct of fixed size: the four bytes of CDR's header (little endian,
//!   plain), then the columns of 8 bytes in their order, then those of 4, then those of 1. Fields
//!   are named as the columns, in lower case, as `ros2msg` demands. `state` is a number with a
//!   constant for each state.
//! - Channel `/hapticd/marks` has the [`Mark`]s: message encoding `json`, schema in `jsonschema`.
//! - A message's log time is the moment of its row: the beginning of the recording, plus the time
//!   since its first row. A mark has that of the row before it. A message's sequence is the lower
//!   half of its tick.
//! - Chunks are not compressed, and are 250 rows at most, so that a reader finds a row by counting.
//!
//! A file that is being written is whole at all times. What comes after the last chunk (`DataEnd`, a
//! footer without a summary, the magic bytes) is written together with it, and the next chunk is
//! written over it. So whatever kills the writer, any reader reads the file without a repair up to
//! the last flush. The end of a recording adds a summary: how many messages there are, and an index
//! of the chunks.

mod layout;
mod reader;
mod records;
mod tail;
mod writer;

pub(super) use reader::Reader;
pub(super) use writer::Writer;

#[cfg(doc)]
use crate::{Mark, Metadata};

/// Name of the Metadata record.
const METADATA: &str = "hapticd recording";

/// Topic of the rows.
const SAMPLES: &str = "/hapticd/samples";

/// Topic of the marks.
const MARKS: &str = "/hapticd/marks";

/// Length of a message record's header: channel, sequence, two times.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// JSON Schema of a [`Mark`].
pub const MARK_SCHEMA: &str = include_str!("mark.schema.json");
