//! Recordings that grow, and what a replay takes of them.

use crate::until;
use haptic_recording::{Entry, Mark, Reader, Recording};
use std::path::Path;

/// A recording that can be read.
pub fn read(file: &Path) -> Recording {
    haptic_recording::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// Rows on the disk.
pub fn rows(file: &Path) -> usize {
    let found = haptic_recording::open_any(file).and_then(Reader::into_recording);
    found.map_or(0, |found| found.rows.len())
}

/// Waits until so many rows in all are on the disk.
pub fn wait_for_rows(file: &Path, in_all: usize) {
    until(&format!("waited in vain for {in_all} rows"), || rows(file) >= in_all);
}

/// Waits until more rows are on the disk.
pub fn wait_for_more_rows(file: &Path, more: usize) {
    wait_for_rows(file, rows(file) + more);
}

/// Whether every row is there: a machine may be so busy that the recorder has no turn.
pub fn is_whole(recording: &Recording) -> bool {
    let is_lost = |(_, mark): &(usize, Mark)| matches!(mark, Mark::Lost { .. });
    !recording.marks.iter().any(is_lost)
}

/// Marks and rows in the order of the file.
pub fn entries(recording: &Recording) -> impl Iterator<Item = Entry> {
    let mut marks = recording.marks.iter().peekable();
    let mut rows = recording.rows.iter().enumerate().peekable();
    std::iter::from_fn(move || {
        let at = rows.peek().map_or(usize::MAX, |(index, _)| *index);
        if let Some((_, mark)) = marks.next_if(|(before, _)| *before <= at) {
            return Some(Entry::Mark(mark.clone()));
        }
        rows.next()
            .map(|(index, row)| Entry::Row(*row, recording.rows_y.get(index).copied()))
    })
}
