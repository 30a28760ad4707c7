//! A recording's parts between two snapshots, compared on all processors.
//!
//! One thread reads. What follows a snapshot is gathered until the next one, and compared by whichever
//! thread is free: nothing before the snapshot matters to it. What has no snapshot before it, or is longer
//! than fits into memory, is compared as it is read.

use super::comparison::{Comparison, Report};
use super::error::ReplayError;
use crossbeam::channel::{Receiver, Sender, bounded};
use haptic_core::snapshot;
use haptic_recording::{Entry, Mark, Metadata, RecordingError};
use std::thread;

/// Most entries that are gathered for one part: three times those between two snapshots at 2 kHz.
const MAX_GATHERED: usize = 60_000;

/// A part, and what is known at its beginning.
type Part = (Comparison, Vec<Entry>);

/// Compares every output of a recording with what was recorded, in the memory of a few parts, however long it is.
///
/// # Errors
/// The recording cannot be read, or not be replayed.
pub fn replay(
    metadata: &Metadata,
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<Report, ReplayError> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let (to_workers, parts) = bounded::<(usize, Part)>(threads);
        let (to_us, compared) = bounded(threads);
        for _ in 0..threads {
            let (parts, to_us) = (parts.clone(), to_us.clone());
            scope.spawn(move || work(&parts, &to_us));
        }
        // Ours are dropped here, so that the workers end with the parts, and the reports with the workers.
        drop((parts, to_us));
        let reports = scope.spawn(move || compared.iter().collect::<Vec<_>>());
        let rest = hand_out(metadata, entries, &to_workers);
        drop(to_workers);
        let mut reports = reports.join().expect("it only collects");
        reports.push((usize::MAX, rest));
        reports.sort_by_key(|(place, _)| *place);
        let mut whole = Report::default();
        for (_, report) in reports {
            whole.append(report?);
        }
        Ok(whole)
    })
}

/// Compares parts as long as there are any.
fn work(parts: &Receiver<(usize, Part)>, to: &Sender<(usize, Result<Report, ReplayError>)>) {
    for (place, part) in parts {
        if to.send((place, compared(part))).is_err() {
            return;
        }
    }
}

fn compared((mut comparison, entries): Part) -> Result<Report, ReplayError> {
    for entry in &entries {
        comparison.entry(entry)?;
    }
    Ok(comparison.report())
}

/// Reads a recording, and hands its parts to the workers; returns what was compared here, the last part with it.
fn hand_out(
    metadata: &Metadata,
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
    to_workers: &Sender<(usize, Part)>,
) -> Result<Report, ReplayError> {
    // It follows the marks, and so knows what holds where a part begins.
    let mut known = Comparison::new(metadata)?;
    let mut here = Report::default();
    let mut streamed = Some(known.begin());
    let mut gathered: Option<Part> = None;
    let mut place = 0;
    for entry in entries {
        let entry = entry?;
        if matches!(&entry, Entry::Mark(Mark::Snapshot { snapshot, .. }) if snapshot.version == snapshot::VERSION) {
            if let Some(streamed) = streamed.take() {
                here.append(streamed.report());
            }
            if let Some(part) = gathered.take() {
                place += 1;
                // The workers end after this.
                to_workers.send((place, part)).unwrap_or_default();
            }
            gathered = Some((known.begin(), Vec::new()));
        }
        known.follow(&entry);
        match (&mut gathered, &mut streamed) {
            (Some((_, entries)), _) if entries.len() < MAX_GATHERED => entries.push(entry),
            (Some(_), _) => {
                if let Some((mut comparison, entries)) = gathered.take() {
                    for entry in entries.iter().chain([&entry]) {
                        comparison.entry(entry)?;
                    }
                    streamed = Some(comparison);
                }
            }
            (None, Some(comparison)) => comparison.entry(&entry)?,
            (None, None) => {}
        }
    }
    if let Some(streamed) = streamed {
        here.append(streamed.report());
    }
    if let Some(part) = gathered {
        here.append(compared(part)?);
    }
    Ok(here)
}
