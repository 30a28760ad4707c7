//! What was read: the record, and what is known of it besides.

use crate::identify::record::Record;

/// A record with what was seen while it was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The record.
    pub record: Record,
    /// The constant force, N, where it is known: that of a computed force is 0.
    pub offset_n: Option<f64>,
    /// Whether positions and forces are known to be of one clock.
    pub has_one_clock: bool,
    /// Which columns were read, and what was left out.
    pub notes: Vec<String>,
}
