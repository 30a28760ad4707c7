//! The limit on frames: the eye sees at most 30 a second.

use std::time::{Duration, Instant};

/// Most frames a second, Hz.
const FRAMES_HZ: f64 = 30.0;

/// Delay of a frame, so that it shows two updates that come right after one another.
const GATHER: Duration = Duration::from_millis(1);

/// The time at which the newest requested frame is due.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameLimiter(Option<Instant>);

impl FrameLimiter {
    /// How long an update that arrives `now` waits for its frame.
    pub(crate) fn wait(&mut self, now: Instant) -> Duration {
        let soonest = now + GATHER;
        let due = match self.0 {
            // The frame that is due shows it as well.
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
    fn updates_are_drawn_soon_and_at_most_thirty_times_a_second() {
        let begin = Instant::now();
        let mut limiter = FrameLimiter::default();
        let mut frames = BTreeSet::new();
        // A thousand updates in a second, then one after a pause.
        for ms in (0..1000).chain([5000]) {
            let now = begin + Duration::from_millis(ms);
            frames.insert(now + limiter.wait(now));
        }
        assert!((28..=32).contains(&frames.len()), "{} frames", frames.len());
        let frames: Vec<_> = frames.into_iter().collect();
        assert!(frames.windows(2).all(|pair| (pair[1] - pair[0]).as_secs_f64() > 0.0333));
        assert_eq!(frames.last(), Some(&(begin + Duration::from_millis(5001))));
    }
}
