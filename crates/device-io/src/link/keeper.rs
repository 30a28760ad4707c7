//! The keeper of a link: finds the device, greets it, hands the connection to the real-time thread, takes it back when it has failed, and looks again. It looks when something changes among the
//! device nodes, and otherwise only asks again a device that is there and does not answer.

use super::health::LinkCounters;
use super::nodes::NodeWatch;
use super::{Connection, Handover, LinkDevice};
use rtrb::{Consumer, Producer, RingBuffer};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use thiserror::Error;

/// Why a device cannot be used, now.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConnectError {
    /// It is not plugged in.
    #[error("{what} is not there")]
    Absent {
        /// What was looked for.
        what: String,
    },
    /// Something is in the way that goes away by itself or by a person: no right, in use, a wrong kind of file.
    #[error("{what}: {why}; {remedy}")]
    Refused {
        /// The device.
        what: String,
        /// What the system says.
        why: String,
        /// How to mend it.
        remedy: String,
    },
    /// It is there, and does not speak the protocol.
    #[error("{what}: {heard}")]
    Protocol {
        /// The device.
        what: String,
        /// What came instead of an answer.
        heard: String,
    },
}

/// A device that has been greeted, and what there is to know of it.
pub struct Greeted {
    pub(crate) connection: Box<dyn Connection>,
    pub(crate) firmware: String,
    pub(crate) force_limit_n: f64,
    pub(crate) sample_rate_hz: f64,
}

/// Finds and greets one kind of device.
pub trait Connector: Send + std::fmt::Debug {
    /// What it connects to, for people.
    fn address(&self) -> String;

    /// The folder in which the device's node appears and disappears.
    fn folder(&self) -> PathBuf;

    /// Whether a change of a node with this name in that folder may be one of the device.
    fn concerns(&self, node: &OsStr) -> bool;

    /// Finds the device, opens and greets it. May take a second.
    ///
    /// # Errors
    /// Why it cannot be used.
    fn connect(&mut self, period_ns: u64, counters: &Arc<LinkCounters>) -> Result<Greeted, ConnectError>;
}

/// How a link stands.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkState {
    /// Looking for the device.
    Looking,
    /// It cannot be used.
    Waiting(ConnectError),
    /// It has been greeted.
    Connected {
        /// Name and version of the firmware.
        firmware: String,
        /// Largest force of the motor, N.
        force_limit_n: f64,
        /// Samples a second, Hz.
        sample_rate_hz: f64,
        /// Distance between two counts, m.
        resolution_m: f64,
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
        let device = LinkDevice {
            address: connector.address(),
            connection: None,
            greeted: to_use,
            failed: given_up,
            resolution_m: 0.0,
            force_limit_n: f64::INFINITY,
            now_ns: 0,
        };
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
        while !quit.load(SeqCst) {
            // Whatever changes from here on, also while it is being connected, is seen below.
            nodes.clear();
            match self.connector.connect(self.period_ns, &self.monitor.counters) {
                Ok(greeted) => {
                    self.monitor.set(LinkState::Connected {
                        firmware: greeted.firmware,
                        force_limit_n: greeted.force_limit_n,
                        sample_rate_hz: greeted.sample_rate_hz,
                        resolution_m: greeted.connection.resolution_m(),
                    });
                    // There is room: the last one has come back.
                    drop(self.greeted.push(Handover {
                        connection: greeted.connection,
                        force_limit_n: greeted.force_limit_n,
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
