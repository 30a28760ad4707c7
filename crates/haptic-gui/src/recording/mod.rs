//! Recordings: the progress of one that is written, and the content of one that is opened.

#[cfg(test)]
#[path = "../../tests/fixture/metadata.rs"]
pub(crate) mod fixture;
mod loaded;
mod progress;

pub use loaded::Loaded;
pub(crate) use loaded::Opened;
pub use progress::RecordingNews;
pub(crate) use progress::amount;
