//! The way of news to the window.

use crate::beat::Beat;
use crate::update::Update;
use std::fmt;
use std::sync::mpsc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Nobody wants the news any more.
#[derive(Debug)]
pub(crate) struct PanelGone;

/// Tells the window what is new. Every thread that has news has one.
#[derive(Clone)]
pub(crate) struct News {
    updates: mpsc::Sender<Update>,
    repaint: Arc<dyn Fn(Duration) + Send + Sync>,
    beat: Arc<Mutex<Beat>>,
}

impl fmt::Debug for News {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("News").finish_non_exhaustive()
    }
}

impl News {
    pub(crate) fn new(repaint: impl Fn(Duration) + Send + Sync + 'static) -> (Self, mpsc::Receiver<Update>) {
        let (updates, told) = mpsc::channel();
        let news = Self {
            updates,
            repaint: Arc::new(repaint),
            beat: Arc::default(),
        };
        (news, told)
    }

    /// Tells something, to be drawn with what else is new.
    pub(crate) fn tell(&self, update: Update) -> Result<(), PanelGone> {
        self.tell_undrawn(update)?;
        let wait = {
            let mut beat = self.beat.lock().unwrap_or_else(PoisonError::into_inner);
            beat.wait(Instant::now())
        };
        (self.repaint)(wait);
        Ok(())
    }

    /// Tells something that is to be drawn now.
    pub(crate) fn tell_at_once(&self, update: Update) -> Result<(), PanelGone> {
        self.tell_undrawn(update)?;
        (self.repaint)(Duration::ZERO);
        Ok(())
    }

    /// Tells something that looks like what is drawn already.
    pub(crate) fn tell_undrawn(&self, update: Update) -> Result<(), PanelGone> {
        self.updates.send(update).map_err(|_| PanelGone)
    }
}
