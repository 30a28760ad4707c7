//! What becomes final in a session.

use super::super::trial::{FittsTrial, PerceptionTrial, VoidedTrial};
use super::ticks::Ticks;

/// The row of a trial.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// Of the targeting task.
    Fitts(Box<FittsTrial>),
    /// Of the perception tests.
    Perception(Box<PerceptionTrial>),
}

/// A trial that is done.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedTrial {
    /// Its row.
    pub row: Row,
    /// Whether it is for practice.
    pub is_practice: bool,
    /// Its ticks; none where nobody knows which scene they rendered.
    pub ticks: Option<Ticks>,
}

/// What the disk must get.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// A trial is done.
    Finished(Box<FinishedTrial>),
    /// An attempt at a trial is void.
    Voided(VoidedTrial),
}
