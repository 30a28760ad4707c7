//! How long the next piece of a linearised motion may be.

use crate::math::powf;

/// Share of the shortest time of the linearised motion that a piece may take where damping is
/// negative: the closed forms lose digits beyond.
pub(super) const LONGEST: f64 = 0.9;

/// Shortest piece that is tried, s: there every error is that of rounding.
const SHORTEST_S: f64 = 1e-30;

/// The length to try after a piece of a length with an error of third order.
pub(super) fn next_length(length: f64, error: f64, tolerance: f64) -> f64 {
    let ratio = tolerance / error;
    let factor = if ratio >= 64.0 {
        4.0
    } else {
        // The root of the third, and a little less.
        (0.85 * powf(ratio, 1.0 / 3.0)).clamp(0.1, 4.0)
    };
    (factor * length).max(SHORTEST_S)
}
