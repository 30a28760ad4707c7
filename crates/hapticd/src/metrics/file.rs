//! The metrics in a file, for the textfile collector of node_exporter: written again every few seconds, whole or not
//! at all.

use crate::control::{RigHandle, whole_file};
use crate::say;
use crate::threads::Workers;
use crate::timers::every;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Time between two writings.
const PERIOD: Duration = Duration::from_secs(5);

/// Timeout of the removal.
const REMOVAL_TIMEOUT: Duration = Duration::from_millis(200);

/// Keeps the file up to date for ever. A disk that hangs holds up one thread, and nobody else.
pub(crate) async fn keep(path: Option<PathBuf>, rig: &RigHandle) {
    let Some(path) = path.map(Arc::new) else {
        return std::future::pending().await;
    };
    let disk = Workers::new("metrics", 1);
    let mut period = every(PERIOD);
    let mut worked = true;
    loop {
        period.tick().await;
        if disk.is_busy() {
            // The writing before still hangs, and was reported: the collector sees the file's age.
            continue;
        }
        let (text, to) = (super::prometheus_text(&super::openmetrics(rig)), Arc::clone(&path));
        let written = disk.run(PERIOD, move || whole_file::refresh(&to, &text)).await;
        let failed = match written {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(error) => Some(error.to_string()),
        };
        if let Some(why) = failed.as_ref().filter(|_| worked) {
            say(&format!("cannot write the metrics to {}: {why}", path.display()));
        }
        worked = failed.is_none();
    }
}

/// Removes the file at the daemon's end: a collector would go on to report its last state. A disk that hangs delays
/// the end by this at most.
pub(crate) async fn remove(path: Option<PathBuf>) {
    if let Some(path) = path {
        let disk = Workers::new("metrics", 1);
        // What is left has the time of its last writing.
        drop(disk.run(REMOVAL_TIMEOUT, move || std::fs::remove_file(path)).await);
    }
}
