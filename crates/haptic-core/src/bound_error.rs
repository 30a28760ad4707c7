//! The refusal of a quantity that is out of range.

use alloc::string::String;
use thiserror::Error;

/// A quantity that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{field} = {value}{of} is out of range: it must be from {min} to {max}{of}", of = with_space(.unit))]
pub struct BoundError {
    /// The quantity.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// The smallest that is allowed.
    pub min: f64,
    /// The largest that is allowed.
    pub max: f64,
    /// The unit of all three.
    pub unit: &'static str,
}

impl BoundError {
    /// Whether `value` is from `min` to `max`.
    ///
    /// # Errors
    /// It is not; NaN never is.
    pub fn check(field: &'static str, value: f64, min: f64, max: f64, unit: &'static str) -> Result<(), Self> {
        if (min..=max).contains(&value) {
            return Ok(());
        }
        Err(Self {
            field,
            value,
            min,
            max,
            unit,
        })
    }
}

fn with_space(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        alloc::format!(" {unit}")
    }
}
