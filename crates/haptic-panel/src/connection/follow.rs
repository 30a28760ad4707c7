//! Requests that are repeated whenever the scene changes.

use haptic_ipc::{ErrorCode, WireError};

/// The state of such a request.
#[derive(Debug)]
pub(super) struct Follow<K> {
    /// What it depends on, by the newest event.
    pub(super) newest: Option<K>,
    /// The same when it was last asked.
    pub(super) asked: Option<K>,
    /// It has no answer yet. One request at a time: a dragged slider does not swamp the daemon.
    is_unanswered: bool,
    /// The daemon does not know the request.
    is_missing: bool,
}

impl<K> Default for Follow<K> {
    fn default() -> Self {
        Self {
            newest: None,
            asked: None,
            is_unanswered: false,
            is_missing: false,
        }
    }
}

impl<K: Clone + PartialEq> Follow<K> {
    /// Whether to ask now; then it counts as asked.
    pub(super) fn is_due(&mut self) -> bool {
        if self.is_missing || self.is_unanswered || self.newest == self.asked {
            return false;
        }
        self.asked.clone_from(&self.newest);
        self.is_unanswered = true;
        true
    }

    pub(super) fn answered(&mut self, result: &Result<serde_json::Value, WireError>) {
        self.is_unanswered = false;
        self.is_missing = result.as_ref().is_err_and(|error| error.code == ErrorCode::UnknownOp);
    }
}
