//! Why a statistic cannot be computed.

use thiserror::Error;

/// Why a statistic cannot be computed, with the figures.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{reason}")]
pub struct StatsError {
    reason: String,
    advice: Option<&'static str>,
}

impl StatsError {
    pub(super) fn new(reason: impl Into<String>) -> Self {
        let reason = reason.into();
        Self { reason, advice: None }
    }

    pub(super) fn with_advice(self, advice: &'static str) -> Self {
        Self {
            advice: Some(advice),
            ..self
        }
    }

    /// What to do about it, in the imperative; absent where the reason says all.
    #[must_use]
    pub const fn advice(&self) -> Option<&'static str> {
        self.advice
    }
}

/// Refuses values that are not finite. The quantity is in the singular, and places count from 1.
pub(super) fn check_finite(what: &'static str, values: impl IntoIterator<Item = f64>) -> Result<(), StatsError> {
    match (1..).zip(values).find(|(_, value)| !value.is_finite()) {
        Some((place, value)) => Err(StatsError::new(format!(
            "{what} {place} is {value}, which is not a finite number"
        ))),
        None => Ok(()),
    }
}

/// Refuses fewer values than are needed. What there is too little of is in the plural.
pub(super) fn check_count(what: &'static str, count: usize, least: usize) -> Result<(), StatsError> {
    if count < least {
        let why = format!("{what}: {count}; at least {least} are needed");
        return Err(StatsError::new(why));
    }
    Ok(())
}

/// Refuses a quantity that is not above zero.
pub(super) fn check_positive(what: &'static str, value: f64, unit: &'static str) -> Result<(), StatsError> {
    if value > 0.0 {
        return Ok(());
    }
    let why = format!("the {what} is {value} {unit}; it must be above 0 {unit}");
    Err(StatsError::new(why))
}
