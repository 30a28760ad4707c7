//! The version of recordings.

/// The version that is written here.
pub(crate) const VERSION: u32 = 1;
