//! Why nothing can be identified at all.

use thiserror::Error;

/// Why nothing can be identified at all.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// A column has another length than the times.
    #[error("the record has {times} times and {values} values of {column}")]
    Length {
        /// The column.
        column: &'static str,
        /// Samples of the time.
        times: usize,
        /// Samples of the column.
        values: usize,
    },
    /// The record is too short for anything.
    #[error("the record has {samples} samples; at least {least} are needed")]
    TooShort {
        /// Samples.
        samples: usize,
        /// Fewest that are accepted.
        least: usize,
    },
    /// A value is not finite.
    #[error("sample {index}: {column} = {value} is not a finite number")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// Index of the sample, from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Time does not grow.
    #[error("sample {index}: its time {t_s} s does not come after {before_s} s")]
    TimeNotIncreasing {
        /// Index of the sample, from 0.
        index: usize,
        /// Its time, s.
        t_s: f64,
        /// Time of the sample before, s.
        before_s: f64,
    },
    /// A value that was given as known cannot be.
    #[error("{name} = {value} is out of range: {range}")]
    Option {
        /// What was given.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is accepted.
        range: &'static str,
    },
    /// The caller cancelled.
    #[error("the identification was cancelled")]
    Cancelled,
}
