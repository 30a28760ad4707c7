//! One value that the user is changing while the daemon, and perhaps another client, changes it too.

use std::time::Duration;

/// How often a value is sent at most while it is dragged, Hz. The eye sees no more, and the daemon compiles a scene for each.
pub(crate) const MAX_SENDS_HZ: f64 = 30.0;

/// The user's side of one value. Where it holds nothing, the value in force is shown.
#[derive(Debug, Default)]
pub(crate) struct Edit {
    /// What the user wants, until the daemon has decided on it.
    wanted: Option<f64>,
    /// The handle is under the pointer's button.
    held: bool,
    /// `wanted` has not been sent yet.
    unsent: bool,
    /// Changes sent and not answered.
    unanswered: u32,
    /// When the last change was sent, s of interface time.
    sent_at: Option<f64>,
    /// What stands in the field while it is typed in.
    pub(crate) typing: Option<String>,
    /// Why the daemon refused the last change.
    refusal: Option<String>,
    /// The tick that applied the last change.
    applied_at: Option<u64>,
}

/// What became of the last change of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// There was none.
    None,
    /// It waits to be sent or answered.
    Pending,
    /// This tick applied it.
    Applied(u64),
    /// The daemon refused it.
    Refused,
}

impl Edit {
    /// What slider and field show.
    pub(crate) fn shown(&self, in_force: f64) -> f64 {
        self.wanted.unwrap_or(in_force)
    }

    /// What became of the last change.
    pub(crate) fn fate(&self) -> Fate {
        if self.unsent || self.unanswered > 0 {
            return Fate::Pending;
        }
        match (&self.refusal, self.applied_at) {
            (Some(_), _) => Fate::Refused,
            (None, Some(tick)) => Fate::Applied(tick),
            (None, None) => Fate::None,
        }
    }

    /// Why the last change was refused.
    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// The user wants `value`.
    pub(crate) fn change(&mut self, value: f64) {
        self.wanted = Some(value);
        self.unsent = true;
    }

    /// Says beside the value why what was typed is none.
    pub(crate) fn reject(&mut self, message: String) {
        self.refusal = Some(message);
    }

    /// Whether the user holds the handle.
    pub(crate) fn hold(&mut self, held: bool) {
        self.held = held;
        self.settle();
    }

    /// What is to be sent at `now`, or how long until something is. A change that is only tried waits for the end of a drag, so
    /// that it is one.
    pub(crate) fn due(&mut self, now: f64, is_try: bool) -> Result<f64, Option<Duration>> {
        let Some(value) = self.wanted.filter(|_| self.unsent && !(is_try && self.held)) else {
            return Err(None);
        };
        let wait = self.sent_at.map_or(0.0, |sent| sent + 1.0 / MAX_SENDS_HZ - now);
        // A clock that jumped must not hold a change back for longer than a period.
        if wait > 0.0 && wait <= 1.0 / MAX_SENDS_HZ {
            return Err(Some(Duration::from_secs_f64(wait)));
        }
        self.unsent = false;
        self.unanswered += 1;
        self.sent_at = Some(now);
        Ok(value)
    }

    /// The daemon answered a change: with the tick that applied it, or why it refused.
    pub(crate) fn answered(&mut self, result: Result<Option<u64>, String>) {
        self.unanswered = self.unanswered.saturating_sub(1);
        (self.applied_at, self.refusal) = match result {
            Ok(tick) => (tick, None),
            Err(why) => (None, Some(why)),
        };
        self.settle();
    }

    /// Another client changed the value: a remark on ours is void.
    pub(crate) fn overtaken(&mut self) {
        if self.wanted.is_none() {
            (self.refusal, self.applied_at) = (None, None);
        }
    }

    /// Gives the value back to the daemon once it has decided on everything that was wanted.
    fn settle(&mut self) {
        if !self.held && !self.unsent && self.unanswered == 0 {
            self.wanted = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_thinned_and_its_last_value_is_sent() {
        let mut edit = Edit::default();
        edit.hold(true);
        let mut sent = Vec::new();
        for frame in 0..144 {
            let now = f64::from(frame) / 144.0;
            edit.change(f64::from(frame));
            sent.extend(edit.due(now, false));
        }
        edit.hold(false);
        assert!((25..=31).contains(&sent.len()), "{} changes in a second", sent.len());
        let wait = edit.due(1.0, false).expect_err("too early").expect("a value waits");
        assert_eq!(edit.due(1.0 + wait.as_secs_f64() + 1e-9, false), Ok(143.0));
        assert_eq!(edit.due(2.0, false), Err(None));
    }

    #[test]
    fn the_value_wanted_is_shown_until_the_daemon_has_decided() {
        let mut edit = Edit::default();
        edit.change(2.0);
        assert_eq!(edit.due(0.0, false), Ok(2.0));
        assert_eq!(edit.shown(1.0), 2.0);
        assert_eq!(edit.fate(), Fate::Pending);
        edit.answered(Err("too much".into()));
        assert_eq!(edit.fate(), Fate::Refused);
        assert_eq!(edit.shown(1.0), 1.0);
        assert_eq!(edit.refusal(), Some("too much"));
    }

    #[test]
    fn an_answer_during_a_drag_does_not_move_the_handle() {
        let mut edit = Edit::default();
        edit.hold(true);
        edit.change(2.0);
        assert_eq!(edit.due(0.0, false), Ok(2.0));
        edit.answered(Ok(Some(9)));
        assert_eq!((edit.shown(1.0), edit.fate()), (2.0, Fate::Applied(9)));
        edit.hold(false);
        assert_eq!(edit.shown(1.0), 1.0);
    }

    #[test]
    fn a_try_is_sent_when_the_handle_is_let_go() {
        let mut edit = Edit::default();
        edit.hold(true);
        edit.change(2.0);
        assert_eq!(edit.due(0.0, true), Err(None));
        edit.hold(false);
        assert_eq!(edit.due(0.1, true), Ok(2.0));
    }
}
