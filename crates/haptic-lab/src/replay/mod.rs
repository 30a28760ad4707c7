//! Replay: the servo, stepped again through the inputs that a recording holds.
//!
//! [`replay`] compares every output with what was recorded, to the last bit. [`WhatIf`] steps the
//! same motion with another scene: what would have been felt instead.
//!
//! A recording holds the servo's inputs, and its state in snapshots: before the first row, after every gap
//! and every ten seconds. A replay begins at any of them. Rows without one before them are compared where
//! the rig is without force: little of the state matters there, so the servo is built again, and counts once
//! it has given the recorded numbers for [`SETTLED_TICKS`] in a row, or has seen more samples than its
//! estimate of velocity remembers. What is not compared is counted, with the reason ([`SkipReason`]).

mod columns;
mod comparison;
mod error;
mod parallel;
mod scenes;
mod seek;
mod stepper;
mod what_if;
mod without_snapshot;

pub use columns::Value;
pub use comparison::{Comparison, Difference, Report, SkippedTicks};
pub use error::{ReplayError, SkipReason};
pub use parallel::replay;
pub use scenes::Alternative;
pub use seek::{from, snapshot_at};
pub use stepper::{MAX_MEMORY_SAMPLES, SETTLED_TICKS};
pub use what_if::{LargestDifference, Summary, Tally, WhatIf, WhatIfRow};

#[cfg(test)]
mod tests;
