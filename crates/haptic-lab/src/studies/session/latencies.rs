//! How late the cursor was shown during a trial.

use crate::median::median;

/// Latencies of a trial's frames, s.
#[derive(Debug, Default)]
pub(super) struct Latencies(Vec<f64>);

impl Latencies {
    pub(super) fn push(&mut self, latency_s: f64) {
        self.0.push(latency_s);
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Their median, and what 95 % of them do not exceed, s.
    pub(super) fn median_and_p95_s(&mut self) -> (Option<f64>, Option<f64>) {
        let median = median(&mut self.0);
        self.0.sort_unstable_by(f64::total_cmp);
        let last = self.0.len().saturating_sub(1);
        (median, self.0.get((last * 19).div_ceil(20)).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_twentieth_is_not_hidden_by_the_median() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.median_and_p95_s(), (None, None));
        for frame in 0..=20 {
            latencies.push(if frame < 19 { 0.01 } else { 0.08 });
        }
        assert_eq!(latencies.median_and_p95_s(), (Some(0.01), Some(0.08)));
    }
}
