//! Recordings: the progress of one that is written, and the content of one that is opened.

#[cfg(test)]
#[path = "../../tests/fixture/metadata.rs"]
pub(crate) mod fixture;
mod listing;
mod loaded;
mod progress;
mod what_if;

pub(crate) use listing::list;
pub use listing::{About, Length, Listed};
pub use loaded::Loaded;
pub(crate) use loaded::Opened;
pub use progress::RecordingNews;
pub(crate) use progress::amount;
pub use what_if::WhatIfTape;
