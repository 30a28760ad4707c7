//! The edits of one parameter: of both directions together, or of each.

use super::edit::{Edit, Hand, Outcome};
use haptic_core::Direction;
use haptic_ipc::ParameterDescription;

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
            self.both.change(about.value.positive, Hand::Once);
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
