//! Recordings: every tick of a rig in a file that other programs read too.
//!
//! A recording holds its [`Metadata`], a row for each [sample](haptic_ipc::Sample), and [`Mark`]s for
//! what happened, each before the first row that it concerns. It is a file in one of three
//! [`Format`]s, which hold the same: [`mcap`], [`csv`] and [`parquet`] specify them.
//!
//! The rows are what the daemon's servo was stepped with and what it gave. With the settings in the
//! metadata and the scenes in the marks a [`Servo`](haptic_core::servo::Servo) gives the same forces
//! again, to the last bit, where every tick is a row: from any [`Mark::Snapshot`] on, which holds its state.
//!
//! A recording of two axes is of version 2, whose rows have the columns of [`SampleY`](haptic_ipc::SampleY) too: a
//! program that knows version 1 alone refuses it. [`open`] takes one axis, [`open_any`] both.
//!
//! A recording that was broken off, by a full disk or a dead process, reads up to its last whole
//! entry, and [`Ending`] says so.
#![forbid(unsafe_code)]

mod columns;
mod copy;
pub mod csv;
mod cut;
mod error;
mod format;
mod mark;
pub mod mcap;
mod metadata;
pub mod parquet;
mod reader;
mod recorder;
mod rows;
mod thread;
mod writer;

pub use copy::{RepairOutcome, collect, export, repair};
pub use cut::{Span, cut};
pub use error::{CopyError, CreateError, Ending, Place, RecordingError};
pub use format::{Format, UnknownFormat};
pub use mark::{Entry, Mark, StateMarks};
pub use metadata::{Metadata, recorded_by};
pub use reader::{Reader, Recording, open, open_any, read};
pub use recorder::{Recorder, create};
pub use thread::{Enqueued, RecordingThread, WaitingParts};
pub use writer::{Totals, Writer};

#[cfg(test)]
mod tests;
