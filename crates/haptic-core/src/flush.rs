//! Flush to zero: where a state decays, it ends at zero instead of lingering among the subnormal
//! numbers.
//!
//! An operation on a number below the normal range can cost a hundred times the usual, and a state
//! that decays towards rest would stay there for thousands of ticks. The processor could flush by
//! itself, but Rust does not allow its floating-point control register to be changed.

/// Smaller than anything that is felt, in SI units of any kind: a state below it is zero. A product
/// of two states above it is still a normal number.
pub(crate) const NOTHING: f64 = 1e-100;

/// `value`, or zero where it is next to nothing.
pub(crate) fn flush(value: f64) -> f64 {
    if value.abs() < NOTHING { 0.0 } else { value }
}
