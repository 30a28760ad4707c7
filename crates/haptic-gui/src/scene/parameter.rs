//! One parameter: its row of the table, and what the user is doing to it.

use super::edit::{Edit, Fate, Hand};
use haptic_core::{Direction, Directional};
use haptic_ipc::ParameterDescription;

/// One parameter.
#[derive(Debug)]
pub(crate) struct ParameterModel {
    /// Its row of the table; `value` is the value in force.
    pub(crate) about: ParameterDescription,
    /// The user wants a row for each direction.
    pub(crate) split: bool,
    /// The user wants to read all that the adviser says of it.
    pub(crate) advice_is_open: bool,
    both: Edit,
    positive: Edit,
    negative: Edit,
}

impl ParameterModel {
    pub(crate) fn new(about: ParameterDescription) -> Self {
        Self {
            about,
            split: false,
            advice_is_open: false,
            both: Edit::default(),
            positive: Edit::default(),
            negative: Edit::default(),
        }
    }

    /// Whether each direction has a row: always when they differ.
    pub(crate) fn is_split(&self) -> bool {
        self.about.directional && (self.split || !self.about.value.is_symmetric())
    }

    /// The value in force, of both directions or of one.
    pub(crate) fn in_force(&self, direction: Option<Direction>) -> f64 {
        self.about.value.get(direction.unwrap_or(Direction::Positive))
    }

    pub(crate) fn edit(&mut self, direction: Option<Direction>) -> &mut Edit {
        match direction {
            None => &mut self.both,
            Some(Direction::Positive) => &mut self.positive,
            Some(Direction::Negative) => &mut self.negative,
        }
    }

    /// Makes both directions equal again, at the value of the positive one.
    pub(crate) fn join(&mut self) {
        self.split = false;
        if !self.about.value.is_symmetric() {
            self.both.change(self.about.value.positive, Hand::Once);
        }
    }

    pub(crate) fn all_edits(&self) -> [&Edit; 3] {
        [&self.both, &self.positive, &self.negative]
    }

    pub(crate) fn edits(&mut self) -> [(Option<Direction>, &mut Edit); 3] {
        [
            (None, &mut self.both),
            (Some(Direction::Positive), &mut self.positive),
            (Some(Direction::Negative), &mut self.negative),
        ]
    }

    pub(crate) fn take_value(&mut self, value: Directional) {
        if self.about.value != value {
            self.about.value = value;
            for (_, edit) in self.edits() {
                edit.overtaken();
            }
        }
    }

    /// What became of the last change, of either direction: what is pending or refused before what is done.
    pub(crate) fn fate(&self) -> Fate {
        let fates = self.all_edits().map(Edit::fate);
        if fates.contains(&Fate::Pending) {
            return Fate::Pending;
        }
        if fates.contains(&Fate::Refused) {
            return Fate::Refused;
        }
        let ticks = fates.into_iter().filter_map(|fate| match fate {
            Fate::Applied(tick) => Some(tick),
            _ => None,
        });
        ticks.max().map_or(Fate::None, Fate::Applied)
    }
}
