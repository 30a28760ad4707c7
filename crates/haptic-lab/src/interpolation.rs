//! Straight lines between samples.

/// Where each of some times, each later than the one before, lies among at least two samples at `t_s`: the sample before
/// it, and the share of the way to the next one. A time beyond the ends has the place of the nearest end.
pub(crate) fn places(t_s: &[f64], times: impl Iterator<Item = f64>) -> impl Iterator<Item = (usize, f64)> {
    let mut left = 0;
    times.map(move |at| {
        while left + 2 < t_s.len() && t_s[left + 1] <= at {
            left += 1;
        }
        let share = (at - t_s[left]) / (t_s[left + 1] - t_s[left]);
        (left, share.clamp(0.0, 1.0))
    })
}

/// The value at a place between a sample and the next one.
pub(crate) fn between(values: &[f64], (left, share): (usize, f64)) -> f64 {
    values[left] + share * (values[left + 1] - values[left])
}
