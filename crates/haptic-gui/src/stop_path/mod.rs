//! The way of a stop to the daemon: a thread that does nothing else, on a connection of its own that is greeted in advance.
//!
//! A press is two atomic stores and a byte on a socket pair that never blocks. Between the press and the bytes on the daemon's socket stands no lock
//! and no queue, and nothing that records, exports, loads, draws or reads samples. The thread tells what became of the stop only afterwards.
//!
//! "Sent" is told when a daemon that has greeted has the whole line in its socket, "not sent" as soon as that is known to take longer than
//! [`line::UNWRITTEN`]. A stop that was not answered is sent again on the next connection: too much of a stop is safe, too little is not.

mod line;
mod stopper;

use crate::news::News;
use crate::update::Update;
use std::io::{self, Write as _};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};
use stopper::Stopper;

/// What the threads of the panel share of stops.
#[derive(Debug)]
pub(crate) struct Stops {
    /// Stops that were asked for.
    pressed: AtomicU64,
    /// When the newest was, ns since `began`.
    pressed_at_ns: AtomicU64,
    /// The newest that the daemon has answered.
    settled: AtomicU64,
    panel_is_gone: AtomicBool,
    began: Instant,
}

impl Stops {
    pub(crate) fn new() -> Self {
        Self {
            pressed: AtomicU64::new(0),
            pressed_at_ns: AtomicU64::new(0),
            settled: AtomicU64::new(0),
            panel_is_gone: AtomicBool::new(false),
            began: Instant::now(),
        }
    }

    /// Number of the newest stop that was asked for; 0 where there was none.
    pub(crate) fn pressed(&self) -> u64 {
        self.pressed.load(Ordering::Acquire)
    }

    /// Number of the newest stop that the daemon has answered.
    pub(crate) fn settled(&self) -> u64 {
        self.settled.load(Ordering::Acquire)
    }

    /// The daemon has answered a stop, and so all before it.
    pub(crate) fn settle(&self, number: u64) {
        self.settled.fetch_max(number, Ordering::AcqRel);
    }

    fn press(&self) {
        let since = u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.pressed_at_ns.store(since, Ordering::Release);
        self.pressed.fetch_add(1, Ordering::AcqRel);
    }

    fn pressed_at(&self) -> Instant {
        self.began + Duration::from_nanos(self.pressed_at_ns.load(Ordering::Acquire))
    }
}

/// Wakes the thread that stops.
#[derive(Debug)]
pub(crate) struct Waker(UnixStream);

impl Waker {
    fn wake(&self) {
        // It does not block. When there is no room, a wake-up waits there already.
        drop((&self.0).write(&[0]));
    }
}

/// The button's end of the path.
#[derive(Debug)]
pub(crate) struct StopPath {
    stops: Arc<Stops>,
    waker: Arc<Waker>,
}

/// The listening thread's end of the path: it knows where the daemon is.
#[derive(Debug)]
pub(crate) struct Guide {
    places: mpsc::Sender<Place>,
    waker: Arc<Waker>,
}

/// Where the daemon's socket is.
#[derive(Debug)]
pub(super) struct Place {
    path: PathBuf,
    /// The panel talks to it, so that a connection for stops is kept ready. Otherwise one is made when a stop is asked for.
    is_connected: bool,
}

impl Guide {
    /// The daemon is looked for at a path, or was found there.
    pub(crate) fn lead_to(&self, path: PathBuf, is_connected: bool) {
        // The thread lives as long as the panel.
        self.places.send(Place { path, is_connected }).unwrap_or(());
        self.waker.wake();
    }
}

impl StopPath {
    /// Starts the thread, and another that tells its news: to tell may wait for the window, to stop must not.
    ///
    /// # Errors
    /// The system has no thread or descriptor left.
    pub(crate) fn start(retry: Duration, news: News) -> io::Result<(Self, Guide)> {
        let stops = Arc::new(Stops::new());
        let (waker, woken) = UnixStream::pair()?;
        waker.set_nonblocking(true)?;
        woken.set_nonblocking(true)?;
        let waker = Arc::new(Waker(waker));
        let (places, looked_for) = mpsc::channel();
        let (told, to_tell) = mpsc::channel();
        let stopper = Stopper::new(Arc::clone(&stops), woken, looked_for, told, retry);
        thread::Builder::new()
            .name("stop".to_owned())
            .spawn(move || stopper.run())?;
        thread::Builder::new().name("stop news".to_owned()).spawn(move || {
            for stop in to_tell {
                if news.tell_at_once(Update::Stop(stop)).is_err() {
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

    /// Asks for a stop. Waits for nothing.
    pub(crate) fn press(&self) {
        self.stops.press();
        self.waker.wake();
    }
}

impl Drop for StopPath {
    fn drop(&mut self) {
        self.stops.panel_is_gone.store(true, Ordering::Release);
        self.waker.wake();
    }
}
