//! The thread that draws. Nothing waits for it: a terminal takes a picture when it likes, and while
//! somebody selects text in it, has it stopped with Ctrl-S, or the network stands still, it takes none.

use super::draw;
use super::draw::Theme;
use super::model::{Model, lock};
use crate::console;
use crate::failure::Failure;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::task::JoinHandle;

/// Pictures a second that a person can still follow.
const REDRAW_EVERY: Duration = Duration::from_millis(100);
/// How long a terminal may take to show the shell again.
const END_TIMEOUT: Duration = Duration::from_secs(1);

pub(super) struct Picture {
    wake: SyncSender<()>,
    thread: JoinHandle<io::Result<()>>,
}

impl Picture {
    pub(super) fn start(model: Arc<Mutex<Model>>) -> Self {
        // One wish is as good as many.
        let (wake, woken) = sync_channel(1);
        Self {
            wake,
            thread: tokio::task::spawn_blocking(move || draw_until_the_end(&model, &woken)),
        }
    }

    /// Asks for a picture before the next is due.
    pub(super) fn draw_now(&self) {
        if self.wake.try_send(()).is_err() {
            // One is coming already, or the thread is at its end.
        }
    }

    /// Waits for the end of the thread, which comes early only where it fails. Safe to drop half-way.
    pub(super) async fn failed(&mut self) -> Failure {
        match (&mut self.thread).await {
            Ok(Ok(())) => Failure::Interrupted,
            Ok(Err(error)) => error.into(),
            Err(error) => std::panic::resume_unwind(error.into_panic()),
        }
    }

    /// Gives the terminal back to the shell.
    pub(super) async fn end(self) {
        drop(self.wake);
        if !self.thread.is_finished() && tokio::time::timeout(END_TIMEOUT, self.thread).await.is_err() {
            // The shell's line must work even where the last picture still stands. Nobody is left to report to.
            drop(crossterm::terminal::disable_raw_mode());
        }
    }
}

fn draw_until_the_end(model: &Mutex<Model>, woken: &Receiver<()>) -> io::Result<()> {
    let _restored = Restore;
    // Also puts the terminal back if anything panics.
    let mut terminal = ratatui::try_init()?;
    let theme = Theme::new(!console::is_forbidden());
    while woken.recv_timeout(REDRAW_EVERY) != Err(RecvTimeoutError::Disconnected) {
        // The model is locked while the picture is made, never while the terminal takes it.
        terminal.draw(|frame| draw::draw(frame, &lock(model), theme))?;
    }
    Ok(())
}

/// Puts the terminal back, however the thread ends.
struct Restore;

impl Drop for Restore {
    fn drop(&mut self) {
        ratatui::restore();
    }
}
