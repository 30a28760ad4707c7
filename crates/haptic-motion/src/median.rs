//! Medians and extents.

/// The median; of an even count, the upper of the two in the middle. `None` if there are no values.
/// The values are reordered.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
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
