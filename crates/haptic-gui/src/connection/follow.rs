//! What is asked anew whenever the scene changes.

use haptic_ipc::{ErrorCode, WireError};

/// How far something that follows from the scene has been asked for.
#[derive(Debug)]
pub(super) struct Follow<K> {
    /// What it follows, as of the newest news.
    pub(super) newest: Option<K>,
    /// What that was when it was last asked for.
    pub(super) asked: Option<K>,
    /// It is not answered yet. Asked once at a time, the daemon cannot be swamped by a slider that is dragged.
    is_unanswered: bool,
    /// The daemon has none.
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
    /// Whether it is to be asked for now.
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
