//! The keeper of a link: it finds the device, greets it, hands the connection to the real-time
//! thread, takes it back after a failure, and looks again. It looks when the device nodes change,
//! and otherwise only repeats its question to a device that is there and does not answer.

use super::connection::Connection;
use super::connector::{ConnectError, Connector, DeviceFacts, LoopTiming};
use super::health::LinkCounters;
use super::link_device::{Handover, LinkDevice};
use super::nodes::NodeWatch;
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The state of a link.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkState {
    /// Looking for the device.
    Looking,
    /// It cannot be used.
    Waiting(ConnectError),
    /// It has been greeted.
    Connected {
        /// The facts from its greeting.
        device: DeviceFacts,
        /// Number of the connection, from 1: that of
        /// [`Device::connection`](crate::device::Device::connection) while it is used.
        connection: u64,
    },
}

/// The view of a link for all threads but the real-time thread.
#[derive(Clone, Debug)]
pub struct LinkMonitor {
    state: Arc<Mutex<LinkState>>,
    counters: Arc<LinkCounters>,
}

impl LinkMonitor {
    /// The state of the link.
    #[must_use]
    pub fn state(&self) -> LinkState {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Its counters.
    #[must_use]
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    fn set(&self, state: LinkState) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }
}

/// Room for connections on their way to one side: only one is in use, and one may still be on its
/// way back.
const ROOM: usize = 4;

/// Time between two questions to a device that is there and does not answer, or may not be opened.
const ASK_AGAIN: Duration = Duration::from_millis(500);

/// Longest time until the keeper sees that a connection has come back, or that it must end.
const LOOK: Duration = Duration::from_millis(20);

/// The keeper before its start.
pub struct Keeper {
    connector: Box<dyn Connector>,
    timing: LoopTiming,
    monitor: LinkMonitor,
    greeted: Producer<Handover>,
    failed: Consumer<Box<dyn Connection>>,
}

impl std::fmt::Debug for Keeper {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Keeper")
            .field("monitor", &self.monitor)
            .finish_non_exhaustive()
    }
}

/// Ends the keeper when it is dropped.
#[derive(Debug)]
pub struct RunningKeeper {
    quit: Arc<AtomicBool>,
}

impl Drop for RunningKeeper {
    fn drop(&mut self) {
        // Does not wait for the keeper: it may be greeting a slow device.
        self.quit.store(true, SeqCst);
    }
}

impl Keeper {
    /// A link through a connector, for a loop: its real-time end, its monitor,
    /// and the keeper, which the caller must start.
    #[must_use]
    pub fn new(connector: Box<dyn Connector>, timing: LoopTiming) -> (LinkDevice, LinkMonitor, Self) {
        let (greeted, to_use) = RingBuffer::new(ROOM);
        let (given_up, failed) = RingBuffer::new(ROOM);
        let device = LinkDevice::new(connector.address(), to_use, given_up);
        let monitor = LinkMonitor {
            state: Arc::new(Mutex::new(LinkState::Looking)),
            counters: Arc::new(LinkCounters::default()),
        };
        let keeper = Self {
            connector,
            timing,
            monitor: monitor.clone(),
            greeted,
            failed,
        };
        (device, monitor, keeper)
    }

    /// Starts the keeper on a thread of its own with the affinity of the caller.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn start(mut self) -> std::io::Result<RunningKeeper> {
        let quit = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&quit);
        std::thread::Builder::new()
            .name("link".to_owned())
            .spawn(move || self.run(&told))?;
        Ok(RunningKeeper { quit })
    }

    fn run(&mut self, quit: &AtomicBool) {
        let mut nodes = NodeWatch::new(self.connector.folder());
        let mut connection = 0;
        while !quit.load(SeqCst) {
            // Every change from here on, also one while it connects, is seen below.
            nodes.clear();
            match self.connector.connect(self.timing, &self.monitor.counters) {
                Ok(greeted) => {
                    connection += 1;
                    // Announced before it can be used: nobody may find it in use and know only the
                    // one before.
                    let DeviceFacts {
                        force_limit_n,
                        resolution_m,
                        ..
                    } = greeted.device;
                    self.monitor.set(LinkState::Connected {
                        device: greeted.device,
                        connection,
                    });
                    // There is room: the last one has come back.
                    drop(self.greeted.push(Handover {
                        connection: greeted.connection,
                        force_limit_n,
                        resolution_m,
                    }));
                    self.wait_for_failure(quit);
                    self.monitor.set(LinkState::Looking);
                }
                Err(error) => {
                    let absent = matches!(error, ConnectError::Absent { .. });
                    self.monitor.set(LinkState::Waiting(error));
                    let mut waited = Duration::ZERO;
                    while !quit.load(SeqCst) && !nodes.changed(LOOK, |node| self.connector.concerns(node)) {
                        waited += LOOK;
                        if !absent && waited >= ASK_AGAIN {
                            break;
                        }
                    }
                }
            }
        }
    }

    /// Returns when the connection has come back, closed.
    fn wait_for_failure(&mut self, quit: &AtomicBool) {
        while !quit.load(SeqCst) {
            if self.failed.pop().is_ok() {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}
