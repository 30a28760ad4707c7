//! What the benchmarks share: numbers of many turns made into one.

/// The middle one of some values.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The value below which so many in a thousand of some sorted values lie.
pub fn percentile(sorted: &[u64], per_mille: usize) -> u64 {
    sorted[(sorted.len() - 1) * per_mille / 1000]
}

/// Nanoseconds as microseconds.
#[expect(clippy::cast_precision_loss, reason = "nanoseconds below 2^53")]
pub fn us(ns: u64) -> f64 {
    ns as f64 * 1e-3
}
