//! An attempt at a trial that does not count.

use super::operator::Operator;
use super::row::{OutOfRange, Trial, check, named};
use serde::{Deserialize, Serialize};

/// An attempt at a trial that was broken off: a fault, a stop, a lost tick, a foreign change of the scene or a pause.
/// The trial was done again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VoidedTrial {
    /// Who did it.
    pub operator: Operator,
    /// Code of the subject.
    pub subject: String,
    /// Session of the subject, from 1.
    pub session: u32,
    /// Whether it was for practice.
    pub practice: bool,
    /// Number of the row that the trial has in its file, from 1.
    pub row: u32,
    /// Tick in which it was broken off.
    pub tick: u64,
    /// Why.
    pub reason: String,
}

impl Trial for VoidedTrial {
    const COLUMNS: &'static [&'static str] = &["operator", "subject", "session", "practice", "row", "tick", "reason"];

    const REQUIRED: &'static [&'static str] = Self::COLUMNS;

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        check(self.row > 0, "row", &self.row, "", "it must be above 0")
    }
}
