//! Replay: the servo, stepped again through the inputs that a recording holds.
//!
//! [`replay`] compares every output with what was recorded, to the last bit. [`WhatIf`] steps the
//! same motion with another scene: what would have been felt instead.
//!
//! A recording holds the servo's inputs and not the servo's state. Without force little of that state
//! matters: the block goes with the hand, and the estimate of velocity either forgets its past within
//! a few ticks or is found from the recorded velocities. A replay therefore begins, and continues after a
//! gap, while the rig is without force: the servo is built again, and compared once it has given the
//! recorded numbers for [`SETTLED_TICKS`] in a row, or has seen more samples than it remembers. What is
//! not compared is counted, with the reason ([`SkipReason`]).

mod clock;
mod comparison;
mod device;
mod error;
mod scenes;
mod skip_reason;
mod stepper;
mod tracker;
mod what_if;

pub use comparison::{Comparison, Difference, Report, SkippedTicks, Value};
pub use error::ReplayError;
pub use scenes::Alternative;
pub use skip_reason::SkipReason;
pub use stepper::{MAX_MEMORY_SAMPLES, SETTLED_TICKS};
pub use what_if::{LargestDifference, Summary, Tally, WhatIf, WhatIfRow};

use haptic_recording::{Entry, Metadata, RecordingError};

/// Steps the servo through the entries of a recording, and compares every output with what was
/// recorded. Takes constant memory, however long the recording.
///
/// # Errors
/// The recording cannot be read, or not be replayed.
pub fn replay(
    metadata: &Metadata,
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<Report, ReplayError> {
    let mut comparison = Comparison::new(metadata)?;
    for entry in entries {
        comparison.entry(&entry?)?;
    }
    Ok(comparison.report())
}

#[cfg(test)]
mod tests;
