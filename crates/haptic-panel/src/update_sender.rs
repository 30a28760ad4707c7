//! Sends updates from any thread to the window.

use crate::frame_limiter::FrameLimiter;
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
