//! Where samples of a record are missing, for all that read records.
//!
//! A gap lies between two neighbouring samples that are more than [`GAP_PERIODS`] of the record's median period
//! apart, so that two or more are missing. The samples at its ends were recorded and do not belong to it; every time
//! between them does. What is taken from a stretch about a time, as a velocity, is wrong up to half of that stretch
//! beside a gap: who takes it gives that reach.

use haptic_motion::median::median_period_s;

/// Longest time between two samples without a gap, in median periods.
const GAP_PERIODS: f64 = 2.5;

/// Times that differ by less than this share of a period are the same.
pub(crate) const SAME_SHARE: f64 = 1e-3;

/// The longest time between two samples without a gap, s.
pub(crate) fn longest_step_s(t_s: &[f64]) -> f64 {
    GAP_PERIODS * median_period_s(t_s.iter().copied())
}

/// The samples before and after each gap, s.
pub(crate) fn gaps(t_s: &[f64]) -> impl Iterator<Item = [f64; 2]> {
    let longest_s = longest_step_s(t_s);
    t_s.array_windows()
        .copied()
        .filter(move |[before, after]| after - before > longest_s)
}

/// Which of some times, each later than the one before, lie in a gap of the samples at `t_s`, or nearer to one than
/// `reach_s`.
pub(crate) fn in_gaps(t_s: &[f64], times: impl Iterator<Item = f64>, reach_s: f64) -> Vec<bool> {
    let beside_s = reach_s - SAME_SHARE * median_period_s(t_s.iter().copied());
    let mut gaps = gaps(t_s)
        .map(|[before, after]| (before - beside_s, after + beside_s))
        .peekable();
    times
        .map(|t| {
            while gaps.next_if(|(_, end_s)| *end_s <= t).is_some() {}
            gaps.peek().is_some_and(|(begin_s, _)| *begin_s < t)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_gap_is_what_lies_between_its_two_samples() {
        // Of 10 ms, after 1.0 s and before 1.06 s.
        let t_s: Vec<f64> = (0..200)
            .filter(|k| !(101..106).contains(k))
            .map(|k| 0.01 * f64::from(k))
            .collect();
        let is_in = |t: f64, reach_s| in_gaps(&t_s, [t].into_iter(), reach_s) == [true];
        for t in [1.0, 1.06, 1.0 + 1e-9, 1.06 - 1e-9, 0.995, 1.065, -1.0, 9.0] {
            assert!(!is_in(t, 0.0), "{t}");
        }
        assert!(is_in(1.001, 0.0) && is_in(1.03, 0.0) && is_in(1.059, 0.0));
        assert!(is_in(0.981, 0.02) && is_in(1.079, 0.02) && !is_in(0.98, 0.02) && !is_in(1.08, 0.02));
        // One sample that is missing is no gap.
        let t_s: Vec<f64> = (0..200).filter(|k| *k != 101).map(|k| 0.01 * f64::from(k)).collect();
        assert_eq!(gaps(&t_s).count(), 0);
        assert!(in_gaps(&[], [1.0].into_iter(), 1.0) == [false] && in_gaps(&[1.0], [1.0].into_iter(), 1.0) == [false]);
    }

    proptest! {
        #[test]
        fn times_lie_in_gaps_as_each_gap_says(
            steps in proptest::collection::vec(prop_oneof![4 => 0.9..1.1, 1 => 1.0..30.0], 1..60),
            places in proptest::collection::vec(-0.1..1.1, 0..60),
            reach_s in prop_oneof![Just(0.0), 0.0..20.0],
        ) {
            let mut t_s = vec![7.0];
            t_s.extend(steps.iter().scan(7.0, |t, step| {
                *t += step;
                Some(*t)
            }));
            let length_s = t_s[t_s.len() - 1] - 7.0;
            let inside = places.iter().map(|place| 7.0 + place * length_s);
            let mut times: Vec<f64> = inside.chain(t_s.iter().copied()).collect();
            times.sort_by(f64::total_cmp);
            let beside_s = reach_s - SAME_SHARE * longest_step_s(&t_s) / GAP_PERIODS;
            let is_near = |t: &f64| gaps(&t_s).any(|[before, after]| before - beside_s < *t && *t < after + beside_s);
            let expected: Vec<bool> = times.iter().map(is_near).collect();
            prop_assert_eq!(in_gaps(&t_s, times.iter().copied(), reach_s), expected);
            // A sample of the record is never in a gap of it.
            prop_assert!(!in_gaps(&t_s, t_s.iter().copied(), 0.0).contains(&true));
        }
    }
}
