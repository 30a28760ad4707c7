//! Why trials cannot be analysed.

use haptic_lab::stats::StatsError;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use thiserror::Error;

/// Why trials cannot be analysed, with the trial or the value.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct AnalysisError(pub(super) String);

impl AnalysisError {
    pub(super) fn no_trials() -> Self {
        Self("there are no trials".to_owned())
    }

    /// Two rows are the same trial of a sequence.
    pub(super) fn twice(trial: u32, sequence: &str) -> Self {
        Self(format!("trial {trial} of {sequence} is there twice"))
    }

    /// Trials of people and of a model are not analysed as one.
    pub(super) fn mixed_operators() -> Self {
        let why =
            "the trials are of more than one kind of operator: analyse those of people and those of a model apart";
        Self(why.to_owned())
    }
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
