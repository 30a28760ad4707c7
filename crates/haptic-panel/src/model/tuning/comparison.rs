//! The differences between the active scene and another one.

use crate::intent::Intent;
use haptic_ipc::{Difference, SceneRef};

/// A comparison of the active scene with another. It is asked for again whenever one of them changes.
#[derive(Debug)]
pub(crate) struct Comparison {
    /// Name of the other scene.
    pub(crate) with: String,
    other: SceneRef,
    /// The revision in the last request.
    asked: Option<u64>,
    is_unanswered: bool,
    pub(crate) found: Option<Found>,
}

/// The result of a comparison.
#[derive(Debug)]
pub(crate) struct Found {
    /// Revision of the active scene.
    pub(crate) revision: u64,
    pub(crate) result: Result<Vec<Difference>, String>,
}

impl Comparison {
    pub(crate) fn new(with: String, other: SceneRef) -> Self {
        Self {
            with,
            other,
            asked: None,
            is_unanswered: false,
            found: None,
        }
    }

    /// The request while `newest` is active. There is one at a time, so that a dragged slider does not
    /// swamp the daemon.
    pub(super) fn due(&mut self, newest: Option<u64>) -> Option<Intent> {
        let revision = newest.filter(|_| !self.is_unanswered && self.asked != newest)?;
        (self.asked, self.is_unanswered) = (newest, true);
        Some(Intent::Compare {
            what: self.with.clone(),
            scene: self.other.clone(),
            revision,
        })
    }

    /// The other scene has changed: asks again.
    pub(super) fn ask_again(&mut self) {
        self.asked = None;
    }

    /// Takes an answer, unless it belongs to another request.
    pub(super) fn take(
        &mut self,
        with: &str,
        other: &SceneRef,
        revision: u64,
        result: Result<Vec<Difference>, String>,
    ) {
        if (self.with.as_str(), &self.other, self.asked) == (with, other, Some(revision)) {
            self.is_unanswered = false;
            self.found = Some(Found { revision, result });
        }
    }
}
