//! A try: a change that goes back by itself after two seconds, unless somebody else has changed the scene.
//!
//! It goes back by `undo`, bound to the revision of the try, so that a change of another client is never
//! taken back. Several tries go back one after the other if they followed one another directly.

use std::time::{Duration, Instant};

/// Duration of a try.
pub(crate) const TRIAL: Duration = Duration::from_secs(2);

/// The active tries.
#[derive(Debug, Default)]
pub(crate) struct Trial {
    /// Whether the user wants changes to be tries.
    pub(crate) is_on: bool,
    /// Sent tries without an answer.
    unanswered: u32,
    /// Revisions of the tries, oldest first.
    tried: Vec<u64>,
    /// The revision to take back: that of the newest try, or of the step back before.
    newest: u64,
    due: Due,
    /// A step back waits for its answer.
    goes_back: bool,
    /// Why a try stays.
    pub(super) failure: Option<String>,
}

/// When a try goes back.
#[derive(Clone, Copy, Debug, Default)]
enum Due {
    /// [`TRIAL`] after the next call of [`Trial::due`].
    #[default]
    AfterTrial,
    At(Instant),
    Now,
}

impl Trial {
    /// Whether a try is active.
    pub(crate) fn is_active(&self) -> bool {
        self.unanswered > 0 || !self.tried.is_empty()
    }

    pub(crate) fn sent(&mut self) {
        self.unanswered += 1;
        self.failure = None;
    }

    /// The daemon has answered a change: with its revision, or `None` for a refusal or a no-op.
    pub(crate) fn answered(&mut self, revision: Option<u64>) {
        if self.unanswered == 0 {
            return;
        }
        self.unanswered -= 1;
        let Some(revision) = revision else {
            return;
        };
        if self.tried.last().is_some_and(|last| last + 1 != revision) {
            self.failure = Some("an earlier try stays: somebody else changed the scene after it".to_owned());
            self.tried.clear();
        }
        self.tried.push(revision);
        (self.newest, self.due) = (revision, Due::AfterTrial);
    }

    /// The revision to take back at `now`, or the time until one is due.
    pub(crate) fn due(&mut self, now: Instant) -> Result<u64, Option<Duration>> {
        if self.tried.is_empty() || self.unanswered > 0 || self.goes_back {
            return Err(None);
        }
        let due = match self.due {
            Due::AfterTrial => now + TRIAL,
            Due::At(due) => due,
            Due::Now => now,
        };
        self.due = Due::At(due);
        if due > now {
            return Err(Some(due - now));
        }
        self.goes_back = true;
        Ok(self.newest)
    }

    /// The daemon has answered the step back: with its revision, or the reason of a refusal.
    pub(crate) fn went_back(&mut self, result: Result<u64, String>) {
        self.goes_back = false;
        match result {
            Ok(revision) => {
                self.tried.pop();
                (self.newest, self.due) = (revision, Due::Now);
            }
            Err(why) => {
                self.failure = Some(format!("the try stays: {why}"));
                self.tried.clear();
            }
        }
    }

    /// The user goes through the changes: no try goes back by itself.
    pub(crate) fn settle(&mut self) {
        self.tried.clear();
        self.failure = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tune::edit::tests::at;

    fn tried(revisions: &[u64]) -> Trial {
        let mut trial = Trial::default();
        for &revision in revisions {
            trial.sent();
            trial.answered(Some(revision));
        }
        trial
    }

    #[test]
    fn a_try_goes_back_after_two_seconds() {
        let mut trial = tried(&[7]);
        assert_eq!(trial.due(at(10.0)), Err(Some(Duration::from_secs(2))));
        assert_eq!(trial.due(at(12.0)), Ok(7));
        assert_eq!(trial.due(at(12.1)), Err(None), "asked once");
        trial.went_back(Ok(8));
        assert!(!trial.is_active());
        assert_eq!(trial.due(at(20.0)), Err(None));
    }

    #[test]
    fn several_tries_go_back_one_after_the_other() {
        let mut trial = tried(&[7, 8]);
        assert!(trial.due(at(0.0)).is_err());
        assert_eq!(trial.due(at(2.0)), Ok(8));
        trial.went_back(Ok(9));
        assert_eq!(trial.due(at(2.1)), Ok(9), "the step back before is the newest change");
        trial.went_back(Ok(10));
        assert!(!trial.is_active());
    }

    #[test]
    fn another_try_restarts_the_two_seconds() {
        let mut trial = tried(&[7]);
        assert!(trial.due(at(0.0)).is_err());
        trial.sent();
        assert_eq!(trial.due(at(2.5)), Err(None), "the answer is awaited");
        trial.answered(Some(8));
        assert_eq!(trial.due(at(3.0)), Err(Some(Duration::from_secs(2))));
    }

    #[test]
    fn nobody_elses_change_is_taken_back() {
        // Somebody else made revision 8.
        let mut trial = tried(&[7, 9]);
        assert!(trial.failure.is_some());
        assert!(trial.due(at(0.0)).is_err());
        assert_eq!(trial.due(at(2.0)), Ok(9));
        trial.went_back(Ok(10));
        assert_eq!(trial.due(at(2.1)), Err(None), "what is older than that is theirs");
        let mut trial = tried(&[7]);
        assert!(trial.due(at(0.0)).is_err());
        assert!(trial.due(at(2.0)).is_ok());
        trial.went_back(Err("the newest revision is 8".to_owned()));
        assert_eq!(trial.due(at(9.0)), Err(None));
        assert_eq!(
            trial.failure.as_deref(),
            Some("the try stays: the newest revision is 8")
        );
    }

    #[test]
    fn a_refused_try_is_not_active() {
        let mut trial = Trial::default();
        trial.sent();
        trial.answered(None);
        assert!(!trial.is_active());
    }
}
