//! A root between two points that enclose it.

/// Most evaluations.
const MOST: usize = 60;

/// Where a function comes to zero between `low` and `high`, at which it has opposite signs: by the
/// false position, with the Illinois rule against a side that stands still (Dowell and Jarratt
/// 1971). It ends where the function is within `close` of zero.
pub(super) fn between(low: f64, high: f64, close: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (low, high);
    let (mut at_a, mut at_b) = (function(a), function(b));
    for _ in 0..MOST {
        let guess = (a * at_b - b * at_a) / (at_b - at_a);
        // Rounding may put it outside, and two equal values nowhere.
        let middle = if guess > a.min(b) && guess < a.max(b) {
            guess
        } else {
            0.5 * (a + b)
        };
        let at_middle = function(middle);
        if at_middle.abs() <= close {
            return middle;
        }
        if (at_middle < 0.0) == (at_b < 0.0) {
            at_a *= 0.5;
        } else {
            (a, at_a) = (b, at_b);
        }
        (b, at_b) = (middle, at_middle);
    }
    b
}
