//! The refusal of a quantity that is out of range.

use core::fmt;

/// A quantity that is out of range.
#[derive(Clone, Copy, Debug, PartialEq)]
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

impl fmt::Display for BoundError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            value,
            min,
            max,
            unit,
        } = self;
        let unit = if unit.is_empty() {
            ""
        } else {
            &alloc::format!(" {unit}")
        };
        write!(
            f,
            "{field} = {value}{unit} is out of range: it must be from {min} to {max}{unit}"
        )
    }
}

impl core::error::Error for BoundError {}
