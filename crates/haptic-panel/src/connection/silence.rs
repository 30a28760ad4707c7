//! How long the daemon has sent no sample. It sends one for every tick, whatever the state of the rig, so without any
//! the numbers that the panel shows are not of now.

use std::time::{Duration, Instant};

/// Time without a sample after which it is reported: nine batches of [`BATCH_MS`](crate::intent::BATCH_MS).
const REPORT_AFTER: Duration = Duration::from_millis(300);

/// Time between two reports of one silence.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// The times of the newest line and the newest sample.
#[derive(Debug)]
pub(super) struct Silence {
    line: Instant,
    sample: Instant,
    /// When to look again.
    due: Instant,
    is_reported: bool,
}

impl Silence {
    /// A conversation begins.
    pub(super) fn new(now: Instant) -> Self {
        Self {
            line: now,
            sample: now,
            due: now + REPORT_AFTER,
            is_reported: false,
        }
    }

    /// A line was received.
    pub(super) fn hear(&mut self, has_samples: bool, now: Instant) {
        self.line = now;
        if has_samples {
            (self.sample, self.due) = (now, now + REPORT_AFTER);
        }
    }

    /// Time without any line.
    pub(super) fn since_line(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.line)
    }

    /// How long to wait for a line before the next [`news`](Self::news); never zero.
    pub(super) fn wait(&self, now: Instant) -> Duration {
        self.due.saturating_duration_since(now).max(Duration::from_millis(1))
    }

    /// What to tell, if anything: the time without a sample, or zero when samples come again.
    pub(super) fn news(&mut self, now: Instant) -> Option<Duration> {
        let lasts = now.saturating_duration_since(self.sample);
        if lasts < REPORT_AFTER {
            return std::mem::take(&mut self.is_reported).then_some(Duration::ZERO);
        }
        if now < self.due {
            return None;
        }
        (self.due, self.is_reported) = (now + REPORT_EVERY, true);
        Some(lasts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H28
    #[test]
    fn no_sample_for_300_ms_is_reported_whatever_else_is_sent() {
        let begin = Instant::now();
        let at = |ms| begin + Duration::from_millis(ms);
        let ms = |ms| Some(Duration::from_millis(ms));
        let mut silence = Silence::new(begin);
        for time in (0..1000).step_by(34) {
            silence.hear(true, at(time));
            assert_eq!(silence.news(at(time + 33)), None, "samples come");
        }
        // The newest came at 986 ms. The daemon still tells its timing.
        silence.hear(false, at(1200));
        assert_eq!(silence.news(at(1285)), None);
        assert_eq!(silence.wait(at(1285)), Duration::from_millis(1));
        assert_eq!(silence.news(at(1286)), ms(300));
        assert_eq!(silence.news(at(1287)), None, "it is reported");
        assert_eq!(silence.wait(at(1287)), Duration::from_millis(99));
        assert_eq!(silence.news(at(1386)), ms(400));
        assert_eq!(silence.since_line(at(1386)), Duration::from_millis(186));
        silence.hear(true, at(1390));
        assert_eq!(silence.news(at(1390)), ms(0), "samples come again");
        assert_eq!(silence.news(at(1391)), None);
    }
}
