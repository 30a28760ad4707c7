//! What a recording consists of.

use crate::mark::Mark;
use haptic_ipc::Sample;

/// A row or a mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A sample.
    Row(Sample),
    /// What happened before the next row.
    Mark(Mark),
}
