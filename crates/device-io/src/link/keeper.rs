//! The keeper of a link: finds the device, greets it, hands the connection to the real-time thread, takes it back when it has failed, and looks again. It looks when something changes among the
//! device nodes, and otherwise only asks again a device that is there and does not answer.

use super::connection::Connection;
use super::connector::{ConnectError, Connector, DeviceFacts};
use super::health::LinkCounters;
use super::link_device::{Handover, LinkDevice};
use super::nodes::NodeWatch;
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How a link stands.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkState {
    /// Looking for the device.
    Looking,
    /// It cannot be used.
    Waiting(ConnectError),
    /// It has been greeted.
    Connected {
        /// What it said of itself.
        device: DeviceFacts,
        /// Counts the connections from 1: the number that [`Device::connection`](crate::device::Device::connection) has while this one is used.
        connection: u64,
    },
}

/// What anybody but the real-time thread may ask of a link.
#[derive(Clone, Debug)]
pub struct LinkMonitor {
    state: Arc<Mutex<LinkState>>,
    counters: Arc<LinkCounters>,
}

impl LinkMonitor {
    /// How the link stands.
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

/// Connections that may be on their way to one side: no more than one lives, and one may still be on its way back.
const ROOM: usize = 4;

/// Between two questions to a device that is there and does not answer, or may not be opened.
const ASK_AGAIN: Duration = Duration::from_millis(500);

/// How soon the keeper sees that a connection has come back, or that it is to end.
const LOOK: Duration = Duration::from_millis(20);

/// The keeper, not yet at work.
pub struct Keeper {
    connector: Box<dyn Connector>,
    period_ns: u64,
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
        // It may be greeting a device that takes its time, which nobody needs to wait for.
        self.quit.store(true, SeqCst);
    }
}

impl Keeper {
    /// A link that a connector makes, for a host with such a period: its real-time end, what can be asked of it, and the keeper, which is to be started.
    #[must_use]
    pub fn new(connector: Box<dyn Connector>, period_ns: u64) -> (LinkDevice, LinkMonitor, Self) {
        let (greeted, to_use) = RingBuffer::new(ROOM);
        let (given_up, failed) = RingBuffer::new(ROOM);
        let device = LinkDevice::new(connector.address(), to_use, given_up);
        let monitor = LinkMonitor {
            state: Arc::new(Mutex::new(LinkState::Looking)),
            counters: Arc::new(LinkCounters::default()),
        };
        let keeper = Self {
            connector,
            period_ns,
            monitor: monitor.clone(),
            greeted,
            failed,
        };
        (device, monitor, keeper)
    }

    /// Begins to look, on a thread of its own with the affinity of the caller.
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
            // Whatever changes from here on, also while it is being connected, is seen below.
            nodes.clear();
            match self.connector.connect(self.period_ns, &self.monitor.counters) {
                Ok(greeted) => {
                    connection += 1;
                    // Told before it can be used, so that nobody finds it in use and knows only the one before.
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
