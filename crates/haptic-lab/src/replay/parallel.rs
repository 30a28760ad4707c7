//! A recording's parts between two snapshots, compared on all processors.
//!
//! One thread reads. What follows a snapshot is gathered until the next one, and compared by whichever
//! thread is free: nothing before the snapshot matters to it. What has no snapshot before it, or is longer
//! than fits into memory, is compared as it is read.

use super::comparison::{Comparison, Report};
use super::error::ReplayError;
use crossbeam::channel::{Receiver, Sender, bounded};
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
        let here = hand_out(metadata, entries, &to_workers);
        drop(to_workers);
        let mut reports = reports.join().expect("it only collects");
        reports.extend(here?.into_iter().map(|(place, report)| (place, Ok(report))));
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
        if to.send((place, after(part).map(Comparison::report))).is_err() {
            return;
        }
    }
}

/// The comparison after a part's entries.
fn after((mut comparison, entries): Part) -> Result<Comparison, ReplayError> {
    for entry in &entries {
        comparison.entry(entry)?;
    }
    Ok(comparison)
}

/// Reads a recording, and hands its parts to the workers; returns those that were compared here, with their places.
fn hand_out(
    metadata: &Metadata,
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
    to_workers: &Sender<(usize, Part)>,
) -> Result<Vec<(usize, Report)>, ReplayError> {
    // It follows the marks, and so knows what holds where a part begins.
    let mut known = Comparison::new(metadata)?;
    let mut here = Vec::new();
    let mut streamed = Some(known.begin());
    let mut gathered: Option<Part> = None;
    let mut place = 0;
    for entry in entries {
        let entry = entry?;
        if matches!(&entry, Entry::Mark(Mark::Snapshot { snapshot, .. }) if snapshot.is_of_this_version()) {
            here.extend(streamed.take().map(|streamed| (place, streamed.report())));
            if let Some(part) = gathered.take() {
                // The workers end after this.
                to_workers.send((place, part)).unwrap_or_default();
            }
            place += 1;
            gathered = Some((known.begin(), Vec::new()));
        }
        known.follow(&entry);
        if let Some(comparison) = &mut streamed {
            comparison.entry(&entry)?;
        } else if let Some((_, entries)) = &mut gathered {
            entries.push(entry);
        }
        if let Some((comparison, entries)) = gathered.take_if(|(_, entries)| entries.len() > MAX_GATHERED) {
            streamed = Some(after((comparison, entries))?);
        }
    }
    here.extend(streamed.map(|streamed| (place, streamed.report())));
    if let Some(part) = gathered {
        here.push((place, after(part)?.report()));
    }
    Ok(here)
}
