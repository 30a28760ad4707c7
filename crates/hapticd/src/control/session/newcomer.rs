//! A client for which there is no place: it is heard for a moment, to stop the rig.

use std::cell::Cell;
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// How long it is heard.
const HEARD_FOR: Duration = Duration::from_millis(100);

/// How long the answer to its stop may take.
const ANSWERED_WITHIN: Duration = Duration::from_secs(2);

/// A client that may only stop the rig.
#[derive(Debug)]
pub(in crate::control) struct Newcomer {
    since: Instant,
    /// Places for clients, all of which are taken.
    pub(super) places: usize,
    /// It has asked for a stop.
    stops: Cell<bool>,
    away: Notify,
}

impl Newcomer {
    /// One that has just come, where all places are taken.
    pub(in crate::control) fn new(places: usize) -> Self {
        Self {
            since: Instant::now(),
            places,
            stops: Cell::new(false),
            away: Notify::new(),
        }
    }

    /// It asks for a stop: it stays until it has its answer.
    pub(in crate::control) fn asks_for_a_stop(&self) {
        self.stops.set(true);
    }

    /// Whether it has not asked for a stop.
    pub(in crate::control) fn is_silent(&self) -> bool {
        !self.stops.get()
    }

    /// For how long it has been heard.
    pub(in crate::control) fn heard_for(&self) -> Duration {
        self.since.elapsed()
    }

    /// Others wait.
    pub(in crate::control) fn send_away(&self) {
        self.away.notify_one();
    }

    /// Until it has been heard for long enough.
    pub(in crate::control) async fn over(&self) {
        drop(tokio::time::timeout(HEARD_FOR, self.away.notified()).await);
        if self.stops.get() {
            tokio::time::sleep(ANSWERED_WITHIN).await;
        }
    }
}
