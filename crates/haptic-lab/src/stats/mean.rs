//! Means, deviations and shares, and their intervals.

use super::CONFIDENCE;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// A mean and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its 95 % interval; `None` where one cluster alone, or several that are alike to the last digits, say nothing of
    /// others.
    pub interval: Option<[f64; 2]>,
    /// How many values there are.
    pub count: usize,
}

/// The arithmetic mean; not a number where there are no values.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The standard deviation with n - 1; not a number for fewer than two values.
#[must_use]
pub fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

/// The root mean square; 0 where there are no values.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (square, count) = values.into_iter().fold((0.0, 0_u32), |(square, count), value| {
        (square + value * value, count + 1)
    });
    (square / f64::from(count.max(1))).sqrt()
}

/// Student's t that a share of [`CONFIDENCE`] does not exceed in size; not a number without a degree of freedom.
#[must_use]
pub fn student_t(degrees_of_freedom: f64) -> f64 {
    student_t_of(CONFIDENCE, degrees_of_freedom)
}

/// The same for another share.
pub(crate) fn student_t_of(share: f64, degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |student| student.inverse_cdf(0.5 * (1.0 + share)))
}

/// The mean of values that come in clusters, as the sequences of one subject do, and its interval. Values are sizes:
/// where none is below zero the mean cannot be either, and the interval ends there.
///
/// Values of one subject are alike, so the clusters count as independent and not the values: the interval is Student's
/// with as many degrees of freedom as there are clusters, less one, on the scatter of the clusters' sums about the mean
/// (Liang and Zeger 1986). Where all clusters are of one size this is the textbook's interval of the clusters' means.
#[must_use]
pub fn clustered_mean(clusters: &[Vec<f64>]) -> Mean {
    let values: Vec<f64> = clusters.iter().flatten().copied().collect();
    let value = mean(&values);
    let count = clusters.iter().filter(|cluster| !cluster.is_empty()).count() as f64;
    let squares: f64 = clusters
        .iter()
        .map(|cluster| cluster.iter().map(|one| one - value).sum::<f64>().powi(2))
        .sum();
    // Sums that differ by their rounding alone are alike.
    let sizes: f64 = values.iter().map(|value| value.abs()).sum();
    let scatter = Some(squares.sqrt()).filter(|scatter| *scatter > ROUNDING * sizes);
    let half =
        scatter.map(|scatter| student_t(count - 1.0) * (count / (count - 1.0)).sqrt() * scatter / values.len() as f64);
    let least = values.iter().copied().fold(0.0, f64::min);
    let floor = if least < 0.0 { f64::NEG_INFINITY } else { 0.0 };
    Mean {
        value,
        interval: half
            .filter(|half| half.is_finite())
            .map(|half| [(value - half).max(floor), value + half]),
        count: values.len(),
    }
}

/// Share of the values' sum that rounding may make of their scatter.
const ROUNDING: f64 = 1e-12;

/// The value below which a share of the sorted values lies, by straight lines between them.
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    #[expect(clippy::cast_sign_loss, reason = "within the values")]
    let below = place as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * place.fract()
}

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
    fn the_interval_of_single_values_is_the_textbooks() {
        // 1 to 5: mean 3, deviation sqrt(2.5), Student's t for 4 degrees of freedom 2.776445.
        let found = clustered_mean(&[1.0, 2.0, 3.0, 4.0, 5.0].map(|value| vec![value]));
        let half = 2.776_445 * 2.5_f64.sqrt() / 5.0_f64.sqrt();
        let [low, high] = found.interval.expect("five clusters");
        assert!(
            (found.value - 3.0).abs() < 1e-12 && (high - low - 2.0 * half).abs() < 1e-6,
            "{found:?}"
        );
    }

    #[test]
    fn values_of_one_subject_are_no_evidence_about_others() {
        let once = clustered_mean(&[vec![1.0], vec![2.0], vec![4.0]]);
        let ten_times = clustered_mean(&[vec![1.0; 10], vec![2.0; 10], vec![4.0; 10]]);
        let width = |mean: &Mean| mean.interval.map(|[low, high]| high - low).expect("three clusters");
        assert!((width(&once) - width(&ten_times)).abs() < 1e-12);
        assert_eq!(clustered_mean(&[vec![1.0, 2.0, 3.0]]).interval, None);
    }

    #[test]
    fn clusters_that_are_alike_have_no_interval() {
        for alike in [0.0, 0.55, 0.1 + 0.2] {
            assert_eq!(clustered_mean(&[vec![alike], vec![alike]]).interval, None);
        }
        assert_eq!(clustered_mean(&[vec![0.3; 3], vec![0.1 + 0.2; 3]]).interval, None);
        assert!(clustered_mean(&[vec![0.3], vec![0.300_000_1]]).interval.is_some());
    }

    #[test]
    fn the_interval_of_sizes_does_not_go_below_zero() {
        let [low, high] = clustered_mean(&[vec![0.1], vec![0.9]]).interval.expect("two clusters");
        assert!(low == 0.0 && high > 5.0, "{low} {high}");
        let [low, _] = clustered_mean(&[vec![-0.1], vec![0.9]]).interval.expect("two clusters");
        assert!(low < 0.0, "{low}");
    }

    #[test]
    fn quantiles_lie_between_the_values() {
        let sorted = [1.0, 2.0, 4.0];
        let found = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(&sorted, share));
        assert_eq!(found, [1.0, 1.5, 2.0, 3.0, 4.0]);
        assert_eq!(quantile(&[7.0], 0.975), 7.0);
    }

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
