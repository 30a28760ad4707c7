//! State that the threads of the stop path share.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Where the daemon's socket is.
#[derive(Debug)]
pub(super) struct SocketPlace {
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
    /// Process of the fake rig that this panel has started; 0 for none.
    own_rig: AtomicU32,
    /// The newest stop that was pressed before that rig was started.
    before_own_rig: AtomicU64,
    panel_is_closed: AtomicBool,
    began: Instant,
}

impl Stops {
    pub(crate) fn new() -> Self {
        Self {
            pressed: AtomicU64::new(0),
            pressed_at_ns: AtomicU64::new(0),
            settled: AtomicU64::new(0),
            own_rig: AtomicU32::new(0),
            before_own_rig: AtomicU64::new(0),
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

    /// This panel has started a fake rig, as the process `pid`, after the stop `before`; `None`: it has ended.
    pub(crate) fn set_own_rig(&self, rig: Option<(u32, u64)>) {
        let (pid, before) = rig.unwrap_or_default();
        self.before_own_rig.store(before, Ordering::Release);
        self.own_rig.store(pid, Ordering::Release);
    }

    /// A daemon has greeted. A stop that waited while there was none is not for a fake rig that was started here
    /// after it, which has no motor; any other daemon gets it. Returns the newest stop that is dropped.
    pub(crate) fn greeted(&self, session: &str) -> Option<u64> {
        // A session is named by the daemon's process.
        let pid = session
            .split_once('-')
            .and_then(|(pid, _)| pid.parse().ok())
            .unwrap_or(0);
        let is_own = pid != 0 && self.own_rig.load(Ordering::Acquire) == pid;
        let before = self.before_own_rig.load(Ordering::Acquire);
        if !is_own {
            return None;
        }
        self.settle(before);
        Some(before)
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
