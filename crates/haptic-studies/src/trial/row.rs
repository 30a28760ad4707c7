//! What a row of a study is: its columns, and the ranges of its values.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt::Display;

/// A row that can be read and written.
pub trait Trial: Serialize + DeserializeOwned {
    /// The columns that are written, in their order.
    const COLUMNS: &'static [Column];

    /// Checks the values.
    ///
    /// # Errors
    /// A value is out of its range.
    fn check(&self) -> Result<(), OutOfRange>;

    /// The names of the columns.
    fn names() -> impl Iterator<Item = &'static str> + Clone {
        Self::COLUMNS.iter().map(|column| column.name)
    }
}

/// A column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, with the unit.
    pub name: &'static str,
    /// Whether a file from elsewhere must have it.
    pub is_required: bool,
    /// Whether it is of yes and no.
    pub is_truth: bool,
}

impl Column {
    pub(super) const fn required(name: &'static str) -> Self {
        Self {
            name,
            is_required: true,
            is_truth: false,
        }
    }

    pub(super) const fn optional(name: &'static str) -> Self {
        Self {
            is_required: false,
            ..Self::required(name)
        }
    }

    pub(super) const fn of_truth(self) -> Self {
        Self { is_truth: true, ..self }
    }
}

/// A value of a row that is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct OutOfRange(String);

/// Checks what a value must be. Its unit stands after a blank.
pub(super) fn check(
    is_right: bool,
    column: &str,
    value: impl Display,
    unit: &str,
    limit: &str,
) -> Result<(), OutOfRange> {
    if is_right {
        return Ok(());
    }
    let why = format!("{column} = {value}{unit} is out of range: {limit}");
    Err(OutOfRange(why))
}

/// Checks a length of the task, m. A larger one is in mm, or in pixels.
pub(super) fn length(column: &str, value_m: f64) -> Result<(), OutOfRange> {
    let is_right = value_m > 0.0 && value_m <= 10.0;
    let limit = "it must be above 0 m, and at most 10 m";
    check(is_right, column, value_m, " m", limit)
}

pub(super) fn not_negative(column: &str, value: f64, unit: &str) -> Result<(), OutOfRange> {
    let is_right = value >= 0.0 && value.is_finite();
    check(is_right, column, value, unit, "it must be 0 or above, and finite")
}

pub(super) fn named(column: &str, value: &str) -> Result<(), OutOfRange> {
    check(!value.is_empty(), column, "``", "", "it must not be empty")
}

/// The session of a row that does not say it: the first.
pub(super) const fn first_session() -> u32 {
    1
}

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
    const COLUMNS: &'static [Column] = &[
        Column::required("operator"),
        Column::required("subject"),
        Column::required("session"),
        Column::required("practice"),
        Column::required("row"),
        Column::required("tick"),
        Column::required("reason"),
    ];

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        check(self.row > 0, "row", self.row, "", "it must be above 0")
    }
}

/// Who did a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Operator {
    /// A person.
    Human,
    /// A model of one. Its trials say nothing about people.
    Simulated,
}

impl Operator {
    /// Its name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Human => "human",
            Self::Simulated => "simulated",
        }
    }
}
