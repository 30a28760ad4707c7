//! The threshold from where a staircase turned.

use super::StatsError;
use super::error::{check_count, check_finite};
use super::mean::{deviation, mean};
use serde::Serialize;

/// What the reversals of a staircase say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StaircaseEstimate {
    /// Mean level of the reversals that count, in the unit of the levels.
    pub threshold: f64,
    /// Standard deviation of those levels.
    pub deviation: f64,
    /// How many reversals count: an even number, so that there are as many tops as bottoms.
    pub reversals: usize,
    /// How many were left out at the beginning.
    pub dropped: usize,
}

/// The mean level of the reversals, in the order in which they came, without the first `dropped` ones (Levitt 1971).
/// Of an odd number that is left, one more is dropped at the beginning.
///
/// The rule decides which share of answers is correct there: 70.7 % where the level falls after two correct answers and
/// rises after a wrong one.
///
/// # Errors
/// Fewer than two reversals are left, or a level is not finite.
pub fn staircase(reversal_levels: &[f64], dropped: usize) -> Result<StaircaseEstimate, StatsError> {
    check_finite("level of reversal", reversal_levels.iter().copied())?;
    let left = reversal_levels.len().saturating_sub(dropped);
    check_count("reversals after the dropped ones", left, 2)?;
    let kept = &reversal_levels[dropped + left % 2..];
    Ok(StaircaseEstimate {
        threshold: mean(kept),
        deviation: deviation(kept),
        reversals: kept.len(),
        dropped: dropped + left % 2,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_tops_as_bottoms_count() {
        // Without the first two, 0.5 0.3 0.6 0.4 0.5 are left, and of those the last four count: 1.8 / 4.
        let found = staircase(&[2.0, 0.2, 0.5, 0.3, 0.6, 0.4, 0.5], 2).expect("five left");
        assert!((found.threshold - 0.45).abs() < 1e-12, "{found:?}");
        assert_eq!((found.reversals, found.dropped), (4, 3));
        let even = staircase(&[0.3, 0.6, 0.4, 0.5], 0).expect("four");
        assert_eq!((even.threshold, even.dropped), (found.threshold, 0));
    }

    #[test]
    fn too_few_reversals_are_refused() {
        for levels in [&[][..], &[0.1], &[0.1, 0.2, 0.3]] {
            let refused = staircase(levels, 2).expect_err("too few").to_string();
            assert!(refused.contains("; at least 2"), "{refused}");
        }
        assert!(staircase(&[0.1, f64::NAN, 0.2], 0).is_err());
    }
}
