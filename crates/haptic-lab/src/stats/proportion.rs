//! How sure a share is.

use super::CONFIDENCE;
use statrs::distribution::{ContinuousCDF, Normal};

/// The 95 % interval of a share, `count` of `all` (Wilson 1927): within 0 and 1 also where all or none are counted. It
/// takes the `all` as independent. From 0 to 1 where there is nothing.
#[must_use]
pub fn share_interval(count: u32, all: u32) -> [f64; 2] {
    if all == 0 {
        return [0.0, 1.0];
    }
    let (has_none, has_all) = (count == 0, count == all);
    let (count, all) = (f64::from(count), f64::from(all));
    let z = Normal::standard().inverse_cdf(0.5 * (1.0 + CONFIDENCE));
    let (share, scale) = (count / all, 1.0 + z * z / all);
    let middle = (share + z * z / (2.0 * all)) / scale;
    let half = z / scale * (share * (1.0 - share) / all + z * z / (4.0 * all * all)).sqrt();
    // Without the last digit's rounding.
    [
        if has_none { 0.0 } else { middle - half },
        if has_all { 1.0 } else { middle + half },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shares_interval_is_the_textbooks() {
        // Newcombe (1998), table I, method 3 (Wilson's score): 81 of 263, 15 of 148, 0 of 20, 29 of 29.
        for (count, all, expected) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (29, 29, [0.8830, 1.0]),
        ] {
            let found = share_interval(count, all);
            for (found, expected) in found.into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 5e-5,
                    "{count} of {all}: {found} is not {expected}"
                );
            }
        }
        assert_eq!(share_interval(0, 0), [0.0, 1.0]);
        assert_eq!(share_interval(30, 30)[1], 1.0);
    }
}
