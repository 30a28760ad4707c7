//! Medians, other places in the order of values, and extents.

/// The value that `share` of each `of` values lie below. `None` if there are no values, or all lie below.
/// The values are reordered.
pub fn at_share(values: &mut [f64], share: usize, of: usize) -> Option<f64> {
    let at = values.len() * share / of;
    (at < values.len()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// What the values span without the twentieth at either end, in their unit; 0 if there are none.
#[must_use]
pub fn span_of_nine_tenths(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let mut at = |share| at_share(&mut values, share, 20).unwrap_or(0.0);
    at(19) - at(1)
}

/// The median; of an even count, the upper of the two in the middle. `None` if there are no values.
/// The values are reordered.
pub fn median(values: &mut [f64]) -> Option<f64> {
    at_share(values, 1, 2)
}

/// The median; of an even count, the mean of the two in the middle. `None` if there are no values.
#[must_use]
pub fn middle(mut values: Vec<f64>) -> Option<f64> {
    let upper = median(&mut values)?;
    let half = values.len() / 2;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    let lower = values[..half].iter().copied().max_by(f64::total_cmp)?;
    Some(0.5 * (lower + upper))
}

/// The least and the greatest; infinite, and the other way round, if there are no values.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
}

/// The median time between samples, s; 1 ms if there are fewer than two.
pub fn median_period_s(t_s: impl Iterator<Item = f64> + Clone) -> f64 {
    let mut periods: Vec<f64> = t_s.clone().skip(1).zip(t_s).map(|(end, start)| end - start).collect();
    median(&mut periods).unwrap_or(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_the_order_are_those_of_sorted_values() {
        assert_eq!(
            (median(&mut []), at_share(&mut [], 9, 10), span_of_nine_tenths(&[])),
            (None, None, 0.0)
        );
        for count in 1..50_u32 {
            let sorted: Vec<f64> = (0..count).map(f64::from).collect();
            let mixed: Vec<f64> = (0..count).map(|k| f64::from(k * 7 % count)).collect();
            let mixed = if count % 7 == 0 { sorted.clone() } else { mixed };
            for (share, of) in [(1, 2), (1, 10), (9, 10), (19, 20)] {
                let expected = sorted[sorted.len() * share / of];
                assert_eq!(
                    at_share(&mut mixed.clone(), share, of),
                    Some(expected),
                    "{share}/{of} of {count}"
                );
            }
            let span = sorted[sorted.len() * 19 / 20] - sorted[sorted.len() / 20];
            assert_eq!(span_of_nine_tenths(&mixed), span, "{count}");
        }
        assert_eq!(at_share(&mut [1.0], 1, 1), None);
    }
}
