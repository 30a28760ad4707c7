//! How often news is drawn: the eye sees no more than 30 frames a second, and the rest would be work for nothing.

use std::time::{Duration, Instant};

/// Frames a second at most, Hz.
const FRAMES_HZ: f64 = 30.0;

/// Of two pieces of news that come one right after the other, both are in the frame.
const GATHER: Duration = Duration::from_millis(1);

/// When the newest frame that was asked for is due.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Beat(Option<Instant>);

impl Beat {
    /// How long news that has come `now` waits for its frame.
    pub(crate) fn wait(&mut self, now: Instant) -> Duration {
        let soonest = now + GATHER;
        let due = match self.0 {
            // A frame that is still to come shows this as well.
            Some(due) if due > now => due,
            Some(due) => soonest.max(due + Duration::from_secs_f64(1.0 / FRAMES_HZ)),
            None => soonest,
        };
        self.0 = Some(due);
        due - now
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn news_is_drawn_soon_and_thirty_times_a_second_at_most() {
        let begin = Instant::now();
        let mut beat = Beat::default();
        let mut frames = BTreeSet::new();
        // A thousand pieces of news in a second, and then one after a while.
        for ms in (0..1000).chain([5000]) {
            let now = begin + Duration::from_millis(ms);
            frames.insert(now + beat.wait(now));
        }
        assert!((28..=32).contains(&frames.len()), "{} frames", frames.len());
        let frames: Vec<_> = frames.into_iter().collect();
        assert!(frames.windows(2).all(|pair| (pair[1] - pair[0]).as_secs_f64() > 0.0333));
        assert_eq!(frames.last(), Some(&(begin + Duration::from_millis(5001))));
    }
}
