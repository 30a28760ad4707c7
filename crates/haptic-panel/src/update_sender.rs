//! Sends updates from any thread to the window, and limits its frames: most updates are drawn at once, and a steady
//! stream of them at the pace that the window needs.

use crate::update::Update;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// The panel is closed: nothing receives updates any more.
#[derive(Debug)]
pub(crate) struct PanelGone;

/// Sends updates to the window and requests the frames that show them. Every thread has its own.
#[derive(Clone)]
pub(crate) struct UpdateSender {
    updates: mpsc::Sender<Update>,
    repaint: Arc<dyn Fn(Duration) + Send + Sync>,
    limiter: Arc<Mutex<FrameLimiter>>,
}

impl fmt::Debug for UpdateSender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("UpdateSender").finish_non_exhaustive()
    }
}

impl UpdateSender {
    pub(crate) fn new(repaint: impl Fn(Duration) + Send + Sync + 'static) -> (Self, mpsc::Receiver<Update>) {
        let (updates, received) = mpsc::channel();
        let sender = Self {
            updates,
            repaint: Arc::new(repaint),
            limiter: Arc::default(),
        };
        (sender, received)
    }

    fn limiter(&self) -> MutexGuard<'_, FrameLimiter> {
        // It is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.limiter.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the time between two frames of a steady stream of updates, for every thread.
    pub(crate) fn set_pace(&self, pace: Duration) {
        self.limiter().set_pace(pace);
    }

    /// Sends an update that the next frame shows.
    pub(crate) fn send(&self, update: Update) -> Result<(), PanelGone> {
        let is_steady = update.is_steady();
        self.send_undrawn(update)?;
        let wait = self.limiter().wait(Instant::now(), is_steady);
        if let Some(wait) = wait {
            (self.repaint)(wait);
        }
        Ok(())
    }

    /// Sends an update and requests a frame at once.
    pub(crate) fn send_at_once(&self, update: Update) -> Result<(), PanelGone> {
        self.send_undrawn(update)?;
        (self.repaint)(Duration::ZERO);
        Ok(())
    }

    /// Sends an update that changes nothing visible.
    pub(crate) fn send_undrawn(&self, update: Update) -> Result<(), PanelGone> {
        self.updates.send(update).map_err(|_| PanelGone)
    }
}

/// Shortest time between two frames: the eye sees at most 30 a second.
pub(crate) const MIN_PERIOD: Duration = Duration::from_nanos(1_000_000_000 / 30);

/// Delay of a frame, so that it shows two updates that come right after one another.
const GATHER: Duration = Duration::from_millis(1);

/// The times of the newest frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameLimiter {
    /// The time between two frames of a steady stream.
    pace: Duration,
    /// The newest frame that is over.
    drawn: Option<Instant>,
    /// The frame that is requested.
    due: Option<Instant>,
}

impl Default for FrameLimiter {
    fn default() -> Self {
        Self {
            pace: MIN_PERIOD,
            drawn: None,
            due: None,
        }
    }
}

impl FrameLimiter {
    pub(crate) fn set_pace(&mut self, pace: Duration) {
        self.pace = pace.max(MIN_PERIOD);
    }

    /// How long an update that arrives `now` waits for its frame; `None` for one of a steady stream whose frame is
    /// requested already: each request wakes the window.
    pub(crate) fn wait(&mut self, now: Instant, is_steady: bool) -> Option<Duration> {
        if let Some(due) = self.due.take_if(|due| *due <= now) {
            self.drawn = Some(due);
        }
        let period = if is_steady { self.pace } else { MIN_PERIOD };
        let soonest = now + GATHER;
        let wanted = self.drawn.map_or(soonest, |drawn| soonest.max(drawn + period));
        // An earlier frame that is requested shows it as well.
        let due = self.due.map_or(wanted, |due| due.min(wanted));
        let is_requested = self.due.replace(due) == Some(due);
        (!is_steady || !is_requested).then(|| due - now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The frames of updates at these times, ms.
    fn frames(limiter: &mut FrameLimiter, updates_ms: impl IntoIterator<Item = u64>, is_steady: bool) -> Vec<u64> {
        let begin = Instant::now();
        let due = updates_ms.into_iter().filter_map(|ms| {
            let due = Duration::from_millis(ms) + limiter.wait(begin + Duration::from_millis(ms), is_steady)?;
            Some(u64::try_from(due.as_millis()).expect("it is soon"))
        });
        due.collect::<BTreeSet<_>>().into_iter().collect()
    }

    #[test]
    fn updates_are_drawn_soon_and_at_most_thirty_times_a_second() {
        // A thousand updates in a second, then one after a pause.
        let frames = frames(&mut FrameLimiter::default(), (0..1000).chain([5000]), false);
        assert!((28..=32).contains(&frames.len()), "{} frames", frames.len());
        assert!(frames.windows(2).all(|pair| pair[1] - pair[0] >= 33));
        assert_eq!(frames.last(), Some(&5001));
    }

    #[test]
    fn steady_stream_is_paced_and_other_changes_draw_at_once() {
        let mut limiter = FrameLimiter::default();
        limiter.set_pace(Duration::from_secs(1));
        assert_eq!(frames(&mut limiter, 0..2500, true), [1, 1001, 2001, 3001]);
        let begin = Instant::now();
        let mut limiter = FrameLimiter::default();
        limiter.set_pace(Duration::from_secs(1));
        let at = |ms| begin + Duration::from_millis(ms);
        let ms = |ms| Some(Duration::from_millis(ms));
        assert_eq!(limiter.wait(at(0), true), Some(GATHER));
        assert_eq!(limiter.wait(at(100), true), ms(901));
        assert_eq!(limiter.wait(at(134), true), None, "it is requested");
        assert_eq!(
            limiter.wait(at(200), false),
            Some(GATHER),
            "a change of state is shown at once"
        );
        assert_eq!(limiter.wait(at(300), true), ms(901), "and a sample with it");
        limiter.set_pace(Duration::from_millis(100));
        assert_eq!(
            limiter.wait(at(334), true),
            Some(GATHER),
            "what is quicker again does not wait"
        );
    }
}
