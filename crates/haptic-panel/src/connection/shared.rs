//! What the threads of a connection share.

use crate::intent::Intent;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Times of the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Wait between two attempts to connect.
    pub retry: Duration,
    /// Time after which a silent daemon is given up. It reports its timing every second.
    pub silence: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            retry: Duration::from_millis(500),
            silence: Duration::from_secs(5),
        }
    }
}

/// State that the two threads share. Its locks are held for a few instructions, never during a read, a
/// write or a wait.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// The requests without an answer, by conversation and number.
    asked: Mutex<HashMap<(u64, u64), Asked>>,
    /// A stop was pressed since the last attempt to connect: the next one is due at once.
    hurries: Mutex<bool>,
    hurry: Condvar,
    /// The socket that the user has chosen.
    chosen: Mutex<Option<PathBuf>>,
}

/// A request without an answer.
#[derive(Debug)]
pub(super) enum Asked {
    Intent(Intent),
    /// A stop by its number.
    Stop(u64),
    Describe,
    Subscribe,
    Advise,
    Scene,
    Library,
    Journal,
    Status,
}

impl Shared {
    pub(super) fn asked(&self) -> MutexGuard<'_, HashMap<(u64, u64), Asked>> {
        // The map is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Connects to this socket from now on.
    pub(super) fn choose(&self, path: PathBuf) {
        *self.chosen.lock().unwrap_or_else(PoisonError::into_inner) = Some(path);
        self.hurry_up();
    }

    /// The socket that the user has chosen.
    pub(super) fn chosen(&self) -> Option<PathBuf> {
        self.chosen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Makes the next attempt to connect due.
    pub(super) fn hurry_up(&self) {
        *self.hurries.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.hurry.notify_all();
    }

    /// Waits before the next attempt, unless a stop is pressed meanwhile.
    pub(super) fn pause(&self, time: Duration) {
        let hurries = self.hurries.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.hurry.wait_timeout_while(hurries, time, |hurries| !*hurries);
        let (mut hurries, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *hurries = false;
    }
}
