//! Why trials cannot be analysed.

use serde::Serialize;
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
    pub reason: String,
}
