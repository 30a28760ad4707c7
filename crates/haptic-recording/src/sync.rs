//! Has a file put on the disk now and then, for the case that the machine loses its power.

use std::fs::File;
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::time::{Duration, Instant};
use std::{io, thread};

/// What a loss of power takes at most.
const EVERY: Duration = Duration::from_secs(5);

/// Asks for it, on a thread of its own: a disk may take seconds.
pub(crate) struct Syncer {
    requests: Option<SyncSender<()>>,
    errors: mpsc::Receiver<io::Error>,
    asked: Instant,
}

impl Syncer {
    /// Begins to look after a file. A pipe needs nothing.
    ///
    /// # Errors
    /// No thread can be started.
    pub(crate) fn new(file: &File) -> io::Result<Self> {
        let (failed, errors) = mpsc::channel();
        let mut requests = None;
        if file.metadata()?.is_file() {
            let file = file.try_clone()?;
            let (sender, asked) = mpsc::sync_channel(1);
            requests = Some(sender);
            let run = move || {
                while asked.recv().is_ok() {
                    if let Err(error) = file.sync_data() {
                        failed.send(error).unwrap_or_default();
                    }
                }
            };
            thread::Builder::new().name("recording-sync".into()).spawn(run)?;
        }
        Ok(Self {
            requests,
            errors,
            asked: Instant::now(),
        })
    }

    /// Asks for it where the time has come.
    ///
    /// # Errors
    /// An earlier one failed: what was written may not be on the disk.
    pub(crate) fn tick(&mut self) -> io::Result<()> {
        if let Ok(error) = self.errors.try_recv() {
            return Err(error);
        }
        if self.asked.elapsed() >= EVERY
            && let Some(requests) = &self.requests
        {
            self.asked = Instant::now();
            // A disk that has not come to its end with the last one is asked later.
            match requests.try_send(()) {
                Ok(()) | Err(TrySendError::Full(()) | TrySendError::Disconnected(())) => {}
            }
        }
        Ok(())
    }
}
