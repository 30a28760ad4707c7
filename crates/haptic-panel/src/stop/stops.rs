//! State that the threads of the stop path share.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Where the daemon's socket is.
#[derive(Debug)]
pub(super) struct Place {
    pub(super) path: PathBuf,
    /// The panel is connected to it, so a connection for stops is kept ready. Otherwise one is made for
    /// each stop.
    pub(super) is_connected: bool,
}

/// The stops that were pressed and answered, for all threads of the panel.
#[derive(Debug)]
pub(crate) struct Stops {
    /// Number of stops that were pressed.
    pressed: AtomicU64,
    /// Time of the newest press, ns since `began`.
    pressed_at_ns: AtomicU64,
    /// The newest that the daemon has answered.
    settled: AtomicU64,
    panel_is_closed: AtomicBool,
    began: Instant,
}

impl Stops {
    pub(crate) fn new() -> Self {
        Self {
            pressed: AtomicU64::new(0),
            pressed_at_ns: AtomicU64::new(0),
            settled: AtomicU64::new(0),
            panel_is_closed: AtomicBool::new(false),
            began: Instant::now(),
        }
    }

    /// Number of the newest stop; 0 before the first.
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

    /// Counts a press.
    pub(super) fn press(&self) {
        let since = u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.pressed_at_ns.store(since, Ordering::Release);
        self.pressed.fetch_add(1, Ordering::AcqRel);
    }

    /// Time of the newest press.
    pub(crate) fn pressed_at(&self) -> Instant {
        self.began + Duration::from_nanos(self.pressed_at_ns.load(Ordering::Acquire))
    }

    /// The panel is closed.
    pub(super) fn close(&self) {
        self.panel_is_closed.store(true, Ordering::Release);
    }

    pub(super) fn is_closed(&self) -> bool {
        self.panel_is_closed.load(Ordering::Acquire)
    }
}
