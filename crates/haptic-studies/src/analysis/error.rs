//! Why trials cannot be analysed.

use haptic_lab::stats::StatsError;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use thiserror::Error;

/// Why trials cannot be analysed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// There are none.
    #[error("there are no trials")]
    NoTrials,
    /// Two rows are the same trial.
    #[error("trial {trial} of {sequence} is there twice")]
    TwiceTheTrial {
        /// Number of the trial.
        trial: u32,
        /// Its sequence, or its subject and case.
        sequence: String,
    },
    /// The rows of a sequence differ where they must not.
    #[error("trial {trial} of {sequence} has {column} = {value} m, the trials before it {expected} m")]
    MixedSequence {
        /// Number of the first trial that differs.
        trial: u32,
        /// Its sequence.
        sequence: String,
        /// The column.
        column: &'static str,
        /// Its value, m.
        value: f64,
        /// Its value in the trials before, m.
        expected: f64,
    },
    /// One name stands for more than one target.
    #[error("condition `{condition}` has {column} = {value} m in {sequence}, and {expected} m elsewhere")]
    MixedCondition {
        /// The condition.
        condition: String,
        /// The sequence that differs.
        sequence: String,
        /// The column.
        column: &'static str,
        /// Its value there, m.
        value: f64,
        /// Its value elsewhere, m.
        expected: f64,
    },
    /// Trials of people and of a model are not analysed as one.
    #[error("the trials are of more than one kind of operator: analyse those of people and those of a model apart")]
    MixedOperators,
}

/// Something that the trials do not show, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refusal {
    /// What it is.
    pub what: String,
    /// Why.
    #[serde(flatten)]
    pub why: Reason,
}

/// Why the trials do not show something; as text with the advice behind it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Reason {
    /// The reason alone.
    pub reason: String,
    /// What to do about it, in the imperative; absent where the reason says all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<String>,
}

impl Display for Reason {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)?;
        // No sentence has two colons.
        let mark = if self.reason.contains(": ") { ';' } else { ':' };
        self.advice
            .as_ref()
            .map_or(Ok(()), |advice| write!(f, "{mark} {advice}"))
    }
}

impl From<String> for Reason {
    fn from(reason: String) -> Self {
        Self { reason, advice: None }
    }
}

impl From<StatsError> for Reason {
    fn from(error: StatsError) -> Self {
        Self {
            reason: error.to_string(),
            advice: error.advice().map(str::to_owned),
        }
    }
}
