//! Recordings that grow, and what a replay takes of them.

use crate::until;
use haptic_recording::{Reader, Recording};
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
