//! The resistance that the others are compared with.

/// Its name in plans and rows.
pub const BASELINE: &str = "baseline";
