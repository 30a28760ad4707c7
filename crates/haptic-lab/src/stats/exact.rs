//! Exact tests of counts. Each gives the probability of counts as uneven as these, or more so, where nothing differs.

use statrs::distribution::{Binomial, Discrete, DiscreteCDF, Hypergeometric};

/// Pairs up to which the sums of binomial coefficients stay finite.
const MAX_SUMMED: u64 = 1000;

/// The sign test, two-sided: as many better as worse would be expected where nothing differs (a binomial test against
/// one half). Ties are left out before. 1 where nothing is better or worse.
///
/// On the pairs in which two treatments disagree this is the exact test of McNemar (1947). Up to 50 pairs it is the
/// nearest number, and up to 1000 its rounding is below 1e-12.
#[must_use]
pub fn sign_test(better: u64, worse: u64) -> f64 {
    let (all, fewer) = (better + worse, better.min(worse));
    // Both tails meet in the middle.
    if better.abs_diff(worse) <= 1 {
        return 1.0;
    }
    if all > MAX_SUMMED {
        let tail = Binomial::new(0.5, all).map_or(1.0, |binomial| binomial.cdf(fewer));
        return (2.0 * tail).min(1.0);
    }
    let (mut ways, mut sum) = (1.0, 1.0);
    for count in 0..fewer {
        let (left, next) = ((all - count) as f64, (count + 1) as f64);
        ways = ways * left / next;
        sum += ways;
    }
    let halvings = i32::try_from(all).unwrap_or(i32::MAX) - 1;
    sum * 0.5_f64.powi(halvings)
}

/// Fisher's exact test, two-sided, of two independent rows of two counts each: the probability of all tables with these
/// margins that are no likelier than this one. 1 where a row or a column is empty.
#[must_use]
pub fn fisher(first: [u64; 2], second: [u64; 2]) -> f64 {
    /// Tables as likely as this one differ from it by rounding.
    const ROUNDING: f64 = 1e-7;
    let (row, column) = (first[0] + first[1], first[0] + second[0]);
    let all = row + second[0] + second[1];
    let Ok(tables) = Hypergeometric::new(all, column, row) else {
        return 1.0;
    };
    let limit = tables.pmf(first[0]) * (1.0 + ROUNDING);
    let (low, high) = ((row + column).saturating_sub(all), row.min(column));
    let (mut counted, mut every) = (0.0, 0.0);
    for pmf in (low..=high).map(|count| tables.pmf(count)) {
        every += pmf;
        counted += if pmf <= limit { pmf } else { 0.0 };
    }
    // Of all tables that is 1 to the last digit.
    counted / every
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_sign_test_is_the_textbooks_without_rounding_noise() {
        // Each count is the nearest number to a fraction of whole numbers.
        for all in 1..=40_u32 {
            let ways =
                |count: u32| (0..count).fold(1_u64, |ways, one| ways * u64::from(all - one) / u64::from(one + 1));
            for fewer in 0..=all / 2 {
                let both_tails = 2 * (0..=fewer).map(ways).sum::<u64>();
                let expected = both_tails as f64 / (1_u64 << all) as f64;
                assert_eq!(
                    sign_test(fewer.into(), (all - fewer).into()),
                    expected.min(1.0),
                    "{fewer} of {all}"
                );
            }
        }
        // Where the sums end and the incomplete beta function continues.
        let (last, next) = (sign_test(470, 530), sign_test(471, 530));
        assert!(last < next && next < 1.15 * last, "{last} {next}");
        assert_eq!([sign_test(5000, 5001), sign_test(0, 0)], [1.0; 2]);
    }

    #[test]
    fn fisher_is_1_where_every_table_counts() {
        for [a, b] in [[3, 3], [7, 8], [20, 21], [90, 90]] {
            assert_eq!(fisher([a, b], [a, b]), 1.0, "{a} {b}");
        }
    }

    #[test]
    fn fishers_tea_comes_out_as_he_had_it() {
        // Fisher (1935): 3 of 4 cups right each way. C(8,4) = 70 ways; 1 + 16 + 16 + 1 are no likelier than this one.
        assert!((fisher([3, 1], [1, 3]) - 34.0 / 70.0).abs() < 1e-12);
        assert!((fisher([4, 0], [0, 4]) - 2.0 / 70.0).abs() < 1e-12);
        assert!((fisher([0, 0], [3, 4]) - 1.0).abs() < 1e-12);
        assert!((fisher([5, 0], [7, 0]) - 1.0).abs() < 1e-12);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Nothing depends on which treatment is called first, or which outcome better.
        #[test]
        fn names_do_not_matter(counts in prop::array::uniform4(0..60_u64)) {
            let [a, b, c, d] = counts;
            prop_assert!((sign_test(a, b) - sign_test(b, a)).abs() < 1e-9);
            let p = fisher([a, b], [c, d]);
            prop_assert!((0.0..=1.0).contains(&p));
            for other in [fisher([c, d], [a, b]), fisher([b, a], [d, c]), fisher([a, c], [b, d])] {
                prop_assert!((p - other).abs() < 1e-6, "{} {}", p, other);
            }
        }
    }
}
