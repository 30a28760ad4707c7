//! Exact tests of counts. Each gives the probability of counts as uneven as these, or more so, where nothing differs.

use statrs::distribution::{Binomial, Discrete, DiscreteCDF, Hypergeometric};

/// The sign test, two-sided: as many better as worse would be expected where nothing differs (a binomial test against
/// one half). Ties are left out before. 1 where nothing is better or worse.
///
/// On the pairs in which two treatments disagree this is the exact test of McNemar (1947).
#[must_use]
pub fn sign_test(better: u64, worse: u64) -> f64 {
    let tail = Binomial::new(0.5, better + worse).map_or(1.0, |binomial| binomial.cdf(better.min(worse)));
    (2.0 * tail).min(1.0)
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
    let sum: f64 = (low..=high)
        .map(|count| tables.pmf(count))
        .filter(|pmf| *pmf <= limit)
        .sum();
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_sign_test_is_that_of_the_textbook() {
        // 2 (C(10,0) + C(10,1)) / 2^10; 2 / 2^5; and even counts.
        for (better, worse, expected) in [
            (9, 1, 22.0 / 1024.0),
            (0, 5, 2.0 / 32.0),
            (4, 4, 1.0),
            (0, 0, 1.0),
            (1, 0, 1.0),
        ] {
            let found = sign_test(better, worse);
            assert!(
                (found - expected).abs() < 1e-12,
                "{better}/{worse}: {found} is not {expected}"
            );
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
