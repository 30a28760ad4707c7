//! How late, and how often, the cursor was shown during a trial.

use haptic_motion::median::median;

/// A frame that showed the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// From the sample on the device to the end of the frame that shows it, s.
    pub latency_s: f64,
    /// From this frame to the next one, s.
    pub lasted_s: f64,
}

/// The frames of a trial.
#[derive(Debug, Default)]
pub(super) struct Frames(Vec<Frame>);

impl Frames {
    pub(super) fn push(&mut self, frame: Frame) {
        self.0.push(frame);
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// The median latency, and what 95 % of them do not exceed, s.
    pub(super) fn median_and_p95_s(&self) -> (Option<f64>, Option<f64>) {
        let mut latencies_s: Vec<f64> = self.0.iter().map(|frame| frame.latency_s).collect();
        latencies_s.sort_unstable_by(f64::total_cmp);
        let last = latencies_s.len().saturating_sub(1);
        let p95_s = latencies_s.get((last * 19).div_ceil(20)).copied();
        (median(&mut latencies_s), p95_s)
    }

    /// Frames a second, by the median time between two.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let mut lasted_s: Vec<f64> = self.0.iter().map(|frame| frame.lasted_s).collect();
        median(&mut lasted_s).filter(|lasted_s| *lasted_s > 0.0).map(f64::recip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_twentieth_is_not_hidden_by_the_median() {
        let mut frames = Frames::default();
        assert_eq!((frames.median_and_p95_s(), frames.rate_hz()), ((None, None), None));
        for number in 0..=20 {
            let is_usual = number < 19;
            frames.push(Frame {
                latency_s: if is_usual { 0.01 } else { 0.08 },
                lasted_s: if is_usual { 0.0125 } else { 0.4 },
            });
        }
        assert_eq!(frames.median_and_p95_s(), (Some(0.01), Some(0.08)));
        assert_eq!(frames.rate_hz(), Some(80.0));
    }
}
