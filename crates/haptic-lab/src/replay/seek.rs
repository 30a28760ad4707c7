//! The part of a recording from a time on, and the servo's state there.

use super::columns::is_same;
use super::error::ReplayError;
use super::stepper::{StepResult, stepper};
use crate::row::RecordedRow;
use haptic_recording::{Entry, Mark, Metadata, RecordingError};
use std::collections::VecDeque;

/// The entries of a recording from the last snapshot on that is not after `from_s`, a time since its first row; the
/// marks before it stay, and say what holds there. Without such a snapshot the rows begin at the time itself.
pub fn from(
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
    from_s: f64,
) -> impl Iterator<Item = Result<Entry, RecordingError>> {
    let mut entries = entries.into_iter();
    let mut ready = VecDeque::new();
    // From the last snapshot on, if there was one.
    let mut kept: Vec<Entry> = Vec::new();
    let (mut first_s, mut is_there) = (None, from_s <= 0.0);
    std::iter::from_fn(move || {
        loop {
            if let Some(entry) = ready.pop_front() {
                return Some(Ok(entry));
            }
            let entry = match entries.next()? {
                Ok(entry) => entry,
                Err(error) => return Some(Err(error)),
            };
            if is_there {
                return Some(Ok(entry));
            }
            match entry {
                Entry::Row(row, y) => {
                    is_there = row.t_s - *first_s.get_or_insert(row.t_s) >= from_s;
                    if is_there {
                        ready.extend(kept.drain(..));
                        ready.push_back(Entry::Row(row, y));
                    } else if !kept.is_empty() {
                        kept.push(Entry::Row(row, y));
                    }
                }
                Entry::Mark(Mark::Snapshot { tick, snapshot }) if snapshot.is_of_this_version() => {
                    let is_of_before = |entry: &Entry| {
                        let passed = matches!(
                            entry,
                            Entry::Row(..) | Entry::Mark(Mark::Snapshot { .. } | Mark::Lost { .. })
                        );
                        !passed
                    };
                    ready.extend(kept.drain(..).filter(is_of_before));
                    kept.push(Entry::Mark(Mark::Snapshot { tick, snapshot }));
                }
                mark if kept.is_empty() => return Some(Ok(mark)),
                mark => kept.push(mark),
            }
        }
    })
}

/// The servo's state before the first row that is not before `from_s`, a time since the recording's first row; `None`
/// where it does not follow from what was recorded.
///
/// # Errors
/// The recording cannot be read, or not be replayed.
pub fn snapshot_at(
    metadata: &Metadata,
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
    from_s: f64,
) -> Result<Option<Mark>, ReplayError> {
    let mut stepper = stepper(metadata, None)?;
    let (mut first_s, mut is_known) = (None, false);
    for entry in entries {
        match entry? {
            Entry::Mark(mark) => {
                is_known |= matches!(mark, Mark::Snapshot { .. });
                stepper.mark(&mark)?;
            }
            Entry::Row(row, _) if row.t_s - *first_s.get_or_insert(row.t_s) >= from_s => {
                return Ok(stepper.snapshot(row.tick).filter(|_| is_known));
            }
            Entry::Row(sample, y) => {
                let row = RecordedRow { sample, y };
                is_known = matches!(stepper.row(&row)?, StepResult::Computed(computed) if is_same(&row, &computed));
            }
        }
    }
    Ok(None)
}
