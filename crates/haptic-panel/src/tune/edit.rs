//! The edits of a parameter, of both directions together or of each, while the daemon, and perhaps another client,
//! changes it as well.

use egui::Id;
use haptic_core::Direction;
use haptic_ipc::ParameterDescription;
use std::time::{Duration, Instant};

/// Most sends a second during a drag, Hz. The eye sees no more, and the daemon compiles a scene for each.
const MAX_SENDS_HZ: u32 = 30;

/// Pause after which the next press of a key is a step of undo of its own.
const KEYS_PAUSE: Duration = Duration::from_secs(1);

/// How the user changes a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum EditBy {
    /// At once: typed, or by a button.
    #[default]
    Once,
    /// By the slider's handle: all of a drag is one step of undo.
    Drag,
    /// By keys on the slider: presses in a row are one step of undo.
    Keys,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    pub(crate) value: f64,
    /// Whether `undo` takes it back together with the change before.
    pub(crate) merge: bool,
}

/// The user's side of one value. Without a wanted value the active one is shown.
#[derive(Debug, Default)]
pub(crate) struct Edit {
    /// The value that the user wants, until the daemon has decided on it.
    wanted: Option<f64>,
    /// The user holds the handle.
    held: bool,
    /// `wanted` waits to be sent.
    unsent: bool,
    /// How `wanted` came about.
    by: EditBy,
    /// How the last sent change came about, while another may continue it.
    run: Option<EditBy>,
    /// Sent changes without an answer.
    unanswered: u32,
    /// Time of the last send.
    sent_at: Option<Instant>,
    /// The text of the field while the user types.
    pub(crate) typing: Option<String>,
    /// The field that was drawn last.
    pub(crate) field: Option<Id>,
    /// Why the daemon refused the last change, or why the typed text is not a value, until something else is done.
    pub(super) refusal: Option<String>,
    /// The tick that applied the last change.
    applied_at: Option<u64>,
}

/// The outcome of the last change of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    None,
    /// It waits for its sending or its answer.
    Pending,
    /// This tick applied it.
    Applied(u64),
    Refused,
}

impl Edit {
    /// The value that slider and field show.
    pub(crate) fn shown(&self, active: f64) -> f64 {
        self.wanted.unwrap_or(active)
    }

    /// The outcome of the last change.
    pub(crate) fn outcome(&self) -> Outcome {
        if self.unsent || self.unanswered > 0 {
            return Outcome::Pending;
        }
        match (&self.refusal, self.applied_at) {
            (Some(_), _) => Outcome::Refused,
            (None, Some(tick)) => Outcome::Applied(tick),
            (None, None) => Outcome::None,
        }
    }

    /// The user wants `value`.
    pub(crate) fn change(&mut self, value: f64, by: EditBy) {
        (self.wanted, self.by) = (Some(value), by);
        self.unsent = true;
        self.refusal = None;
    }

    /// Notes whether the user holds the handle.
    pub(crate) fn hold(&mut self, held: bool) {
        if held && !self.held {
            self.run = None;
        }
        self.held = held;
        self.settle();
    }

    /// The change to send at `now`, or the time until it is due. A try waits for the end of a drag, so that
    /// it is one change.
    pub(crate) fn due(&mut self, now: Instant, is_try: bool) -> Result<Change, Option<Duration>> {
        let Some(value) = self.wanted.filter(|_| self.unsent && !(is_try && self.held)) else {
            return Err(None);
        };
        let since = self.sent_at.map(|sent| now.saturating_duration_since(sent));
        let period = Duration::from_secs(1) / MAX_SENDS_HZ;
        if let Some(since) = since.filter(|since| *since < period) {
            return Err(Some(period - since));
        }
        let continues = match self.by {
            EditBy::Once => false,
            EditBy::Drag => true,
            EditBy::Keys => since.is_some_and(|since| since < KEYS_PAUSE),
        };
        // A try goes back by an undo of its own.
        let merge = continues && !is_try && self.run == Some(self.by);
        self.run = Some(self.by).filter(|_| !is_try);
        self.unsent = false;
        self.unanswered += 1;
        self.sent_at = Some(now);
        Ok(Change { value, merge })
    }

    /// The daemon has answered a change: with the tick that applied it, or the reason of a refusal.
    pub(crate) fn answered(&mut self, result: Result<Option<u64>, String>) {
        self.unanswered = self.unanswered.saturating_sub(1);
        (self.applied_at, self.refusal) = match result {
            Ok(tick) => (tick, None),
            Err(why) => {
                // The next change does not continue this run.
                self.run = None;
                (None, Some(why))
            }
        };
        self.settle();
    }

    /// Another client has changed the value: the outcome of our change is void.
    pub(crate) fn overtaken(&mut self) {
        if self.wanted.is_none() {
            (self.refusal, self.applied_at) = (None, None);
        }
    }

    /// Shows the active value again once the daemon has decided on every change.
    fn settle(&mut self) {
        if !self.held && !self.unsent && self.unanswered == 0 {
            self.wanted = None;
        }
    }
}

/// The user's side of one parameter.
#[derive(Debug)]
pub(crate) struct ParameterEdits {
    pub(super) name: String,
    /// The user has chosen a row for each direction.
    pub(crate) split: bool,
    /// The user reads all advice on it.
    pub(crate) advice_is_open: bool,
    both: Edit,
    positive: Edit,
    negative: Edit,
}

impl ParameterEdits {
    pub(super) fn new(name: String) -> Self {
        Self {
            name,
            split: false,
            advice_is_open: false,
            both: Edit::default(),
            positive: Edit::default(),
            negative: Edit::default(),
        }
    }

    /// Whether each direction has a row: always when they differ.
    pub(crate) fn is_split(&self, about: &ParameterDescription) -> bool {
        about.directional && (self.split || !about.value.is_symmetric())
    }

    pub(crate) fn edit(&mut self, direction: Option<Direction>) -> &mut Edit {
        match direction {
            None => &mut self.both,
            Some(Direction::Positive) => &mut self.positive,
            Some(Direction::Negative) => &mut self.negative,
        }
    }

    /// Makes both directions equal again, at the value of the positive one.
    pub(crate) fn join(&mut self, about: &ParameterDescription) {
        self.split = false;
        if !about.value.is_symmetric() {
            self.both.change(about.value.positive, EditBy::Once);
        }
    }

    pub(super) fn all(&self) -> [&Edit; 3] {
        [&self.both, &self.positive, &self.negative]
    }

    pub(super) fn all_mut(&mut self) -> [(Option<Direction>, &mut Edit); 3] {
        [
            (None, &mut self.both),
            (Some(Direction::Positive), &mut self.positive),
            (Some(Direction::Negative), &mut self.negative),
        ]
    }

    /// Another client has changed the value.
    pub(super) fn overtaken(&mut self) {
        for (_, edit) in self.all_mut() {
            edit.overtaken();
        }
    }

    /// The outcome of the last change of any direction: a pending or refused one before an applied one.
    pub(crate) fn outcome(&self) -> Outcome {
        let outcomes = self.all().map(Edit::outcome);
        if outcomes.contains(&Outcome::Pending) {
            return Outcome::Pending;
        }
        if outcomes.contains(&Outcome::Refused) {
            return Outcome::Refused;
        }
        let ticks = outcomes.into_iter().filter_map(|outcome| match outcome {
            Outcome::Applied(tick) => Some(tick),
            _ => None,
        });
        ticks.max().map_or(Outcome::None, Outcome::Applied)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A time of a clock that began somewhere.
    pub(in crate::tune) fn at(s: f64) -> Instant {
        static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        *BEGIN.get_or_init(Instant::now) + Duration::from_secs_f64(s)
    }

    fn value(due: Result<Change, Option<Duration>>) -> Result<f64, Option<Duration>> {
        due.map(|change| change.value)
    }

    #[test]
    fn a_drag_is_thinned_and_its_last_value_is_sent() {
        let mut edit = Edit::default();
        edit.hold(true);
        let mut sent = Vec::new();
        for frame in 0..144 {
            let now = at(f64::from(frame) / 144.0);
            edit.change(f64::from(frame), EditBy::Drag);
            sent.extend(edit.due(now, false));
        }
        edit.hold(false);
        assert!((25..=31).contains(&sent.len()), "{} changes in a second", sent.len());
        let wait = edit.due(at(1.0), false).expect_err("too early").expect("a value waits");
        assert_eq!(value(edit.due(at(1.0) + wait, false)), Ok(143.0));
        assert_eq!(value(edit.due(at(2.0), false)), Err(None));
    }

    /// Whether each change that was sent continues the one before.
    fn merges(edit: &mut Edit, by: EditBy, at_s: impl IntoIterator<Item = f64>) -> Vec<bool> {
        let changes = at_s.into_iter().map(|at_s| {
            edit.change(at_s, by);
            edit.due(at(at_s), false).expect("it is due").merge
        });
        changes.collect()
    }

    #[test]
    fn drag_or_run_of_key_presses_is_one_undo_step() {
        let mut edit = Edit::default();
        for begin in [1.0, 10.0] {
            edit.hold(true);
            let drag = merges(&mut edit, EditBy::Drag, [begin, begin + 0.1]);
            // A hand may rest in the middle of a drag, and its last value may wait until after it.
            edit.change(0.0, EditBy::Drag);
            edit.hold(false);
            let last = edit.due(at(begin + 8.0), false).expect("it is due");
            assert_eq!((drag, last.merge), (vec![false, true], true), "each drag is a step");
        }
        assert_eq!(
            merges(&mut edit, EditBy::Keys, [18.5, 18.6, 19.5, 20.6]),
            [false, true, true, false]
        );
        assert_eq!(merges(&mut edit, EditBy::Once, [21.0, 21.1]), [false, false]);
        assert_eq!(
            merges(&mut edit, EditBy::Keys, [21.2]),
            [false],
            "not with what was typed"
        );
    }

    #[test]
    fn what_follows_a_refusal_or_a_try_is_a_step_of_its_own() {
        let mut edit = Edit::default();
        edit.hold(true);
        assert_eq!(merges(&mut edit, EditBy::Drag, [1.0, 2.0]), [false, true]);
        edit.answered(Err("too much".into()));
        assert_eq!(merges(&mut edit, EditBy::Drag, [3.0, 4.0]), [false, true]);
        edit.hold(false);
        edit.change(1.0, EditBy::Keys);
        assert!(!edit.due(at(5.0), true).expect("it is due").merge);
        edit.change(2.0, EditBy::Keys);
        assert!(
            !edit.due(at(5.5), true).expect("it is due").merge,
            "each try goes back alone"
        );
        assert_eq!(
            merges(&mut edit, EditBy::Keys, [6.0]),
            [false],
            "what stays is not undone with a try"
        );
    }

    #[test]
    fn the_value_wanted_is_shown_until_the_daemon_has_decided() {
        let mut edit = Edit::default();
        edit.change(2.0, EditBy::Once);
        assert_eq!(value(edit.due(at(0.0), false)), Ok(2.0));
        assert_eq!((edit.shown(1.0), edit.outcome()), (2.0, Outcome::Pending));
        edit.answered(Err("too much".into()));
        assert_eq!((edit.shown(1.0), edit.outcome()), (1.0, Outcome::Refused));
        assert_eq!(edit.refusal.as_deref(), Some("too much"));
        // An answer during a drag does not move the handle.
        edit.hold(true);
        edit.change(2.0, EditBy::Drag);
        assert_eq!(value(edit.due(at(1.0), false)), Ok(2.0));
        edit.answered(Ok(Some(9)));
        assert_eq!((edit.shown(1.0), edit.outcome()), (2.0, Outcome::Applied(9)));
        edit.hold(false);
        assert_eq!(edit.shown(1.0), 1.0);
    }

    #[test]
    fn a_try_is_sent_when_the_handle_is_let_go() {
        let mut edit = Edit::default();
        edit.hold(true);
        edit.change(2.0, EditBy::Drag);
        assert_eq!(value(edit.due(at(0.0), true)), Err(None));
        edit.hold(false);
        assert_eq!(value(edit.due(at(0.1), true)), Ok(2.0));
    }
}
