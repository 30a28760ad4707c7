//! Stop: its button and keys, the report on it, and its path to the daemon.
//!
//! The path is a thread for stops alone, on a connection of its own that the daemon has greeted in advance.
//!
//! A press is two atomic stores and a byte on a socket pair that never blocks. There is neither a lock
//! nor a queue between the press and the daemon's socket, and nothing that records, exports, loads,
//! draws or reads samples. The thread reports the outcome of a stop afterwards.
//!
//! A stop is "sent" when the socket of a daemon that has greeted has the whole line, and "not sent" as
//! soon as that takes longer than [`line::UNWRITTEN`]. An unanswered stop is sent again on the next
//! connection: a stop too many is safe, a stop too few is not.

pub(crate) mod button;
mod line;
pub(crate) mod report;
mod stopper;
mod stops;

pub(crate) use stops::Stops;

use crate::update::Update;
use crate::update_sender::UpdateSender;
use std::io::{self, Write as _};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;
use stopper::Stopper;
use stops::SocketPlace;

/// Wakes the thread that stops.
#[derive(Debug)]
pub(crate) struct Waker(UnixStream);

impl Waker {
    fn wake(&self) {
        // It does not block. Without room, a wake-up is pending already.
        drop((&self.0).write(&[0]));
    }
}

/// The end of the path at the button.
#[derive(Debug)]
pub(crate) struct StopPath {
    stops: Arc<Stops>,
    waker: Arc<Waker>,
}

/// The end of the path at the listening thread, which knows the daemon's socket.
#[derive(Debug)]
pub(crate) struct Guide {
    places: mpsc::Sender<SocketPlace>,
    waker: Arc<Waker>,
}

impl Guide {
    /// Names the path at which the daemon is looked for, or was found.
    pub(crate) fn lead_to(&self, path: PathBuf, is_connected: bool) {
        // The thread lives as long as the panel.
        self.places.send(SocketPlace { path, is_connected }).unwrap_or(());
        self.waker.wake();
    }
}

impl StopPath {
    /// Starts the thread, and another that reports its news: a report may wait for the window, a stop must
    /// not.
    ///
    /// # Errors
    /// The system has no thread or descriptor left.
    pub(crate) fn start(retry: Duration, updates: UpdateSender) -> io::Result<(Self, Guide)> {
        let stops = Arc::new(Stops::new());
        let (waker, woken) = UnixStream::pair()?;
        waker.set_nonblocking(true)?;
        woken.set_nonblocking(true)?;
        let waker = Arc::new(Waker(waker));
        let (places, looked_for) = mpsc::channel();
        let (news, incoming) = mpsc::channel();
        let stopper = Stopper::new(Arc::clone(&stops), woken, looked_for, news, retry);
        thread::Builder::new()
            .name("stop".to_owned())
            .spawn(move || stopper.run())?;
        thread::Builder::new().name("stop news".to_owned()).spawn(move || {
            for stop in incoming {
                if updates.send_at_once(Update::Stop(stop)).is_err() {
                    return;
                }
            }
        })?;
        let path = Self {
            stops,
            waker: Arc::clone(&waker),
        };
        Ok((path, Guide { places, waker }))
    }

    pub(crate) fn stops(&self) -> &Arc<Stops> {
        &self.stops
    }

    /// Requests a stop. Waits for nothing.
    pub(crate) fn press(&self) {
        self.stops.press();
        self.waker.wake();
    }
}

impl Drop for StopPath {
    fn drop(&mut self) {
        self.stops.close();
        self.waker.wake();
    }
}
