//! How late the subject sees the cursor.

use std::time::Duration;

/// Width of a step, ms.
const STEP_MS: f64 = 0.1;

/// Steps that are counted; anything later counts as the last.
const STEPS: usize = 10_000;

/// The latencies of a session, in steps of 0.1 ms.
#[derive(Clone, Debug, Default)]
pub(crate) struct Latencies {
    counts: Vec<u32>,
    /// Frames that were measured.
    pub(crate) frames: u64,
}

impl Latencies {
    pub(crate) fn add(&mut self, latency: Duration) {
        self.counts.resize(STEPS, 0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a duration is not negative, and a large one is cut"
        )]
        let step = (latency.as_secs_f64() * 1e3 / STEP_MS) as usize;
        let count = &mut self.counts[step.min(STEPS - 1)];
        *count = count.saturating_add(1);
        self.frames += 1;
    }

    /// The latency that a share of the frames did not exceed, ms; none before the first frame.
    pub(crate) fn quantile_ms(&self, share: f64) -> Option<f64> {
        if self.frames == 0 {
            return None;
        }
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count of frames"
        )]
        let rank = ((self.frames as f64 * share).ceil() as u64).max(1);
        let mut below = 0;
        let step = self.counts.iter().position(|count| {
            below += u64::from(*count);
            below >= rank
        })?;
        #[expect(clippy::cast_precision_loss, reason = "ten thousand steps")]
        let upper_ms = (step + 1) as f64 * STEP_MS;
        Some(upper_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_end_of_the_step_that_holds_it() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.quantile_ms(0.5), None);
        for ms in 1..=100 {
            latencies.add(Duration::from_micros(1000 * ms + 50));
        }
        latencies.add(Duration::from_secs(3600));
        let near = |share: f64, ms: f64| (latencies.quantile_ms(share).expect("frames") - ms).abs() < 1e-6;
        assert!(near(0.5, 51.1) && near(0.95, 96.1) && near(1.0, 1000.0));
        assert_eq!(latencies.frames, 101);
    }
}
