//! Links to real rigs: who finds and greets a device, and who talks to it.
//!
//! ```text
//!  keeper thread                         real-time thread
//!  looks, opens, greets ── connection ──► LinkDevice: reads and writes, never waits
//!        ▲                                     │
//!        └──────────── connection, when ───────┘
//!                      it has failed
//! ```
//!
//! Everything that waits, allocates or asks the system for a file is done by the keeper, at an ordinary priority. A connection goes to the real-time thread and back
//! through two rings of one producer and one consumer each (rtrb), wait-free on both ends.

mod adapter;
pub(crate) mod clock;
mod device_clock;
#[cfg(test)]
mod frame_tests;
#[cfg(test)]
mod greeted;
mod health;
pub(crate) mod hid;
mod identity;
mod keeper;
mod low_latency;
mod mailbox;
mod nodes;
#[cfg(test)]
mod quality_tests;
mod reports;
mod serial;
mod session;
mod wire;
mod writer;

pub use adapter::{MotorOptions, ODriveConnector, ODriveOptions, SimpleFocConnector, SimpleFocOptions, TargetUnit};
pub use health::{LinkCounters, LinkError, UNKNOWN_DRIFT};
pub use hid::{HidConnector, HidId};
pub use identity::RigIdentity;
pub use keeper::{ConnectError, Connector, Greeted, Keeper, LinkMonitor, LinkState, RunningKeeper};
pub use serial::SerialConnector;
pub(crate) use serial::permission_remedy as serial_permission_remedy;

use crate::device::{Device, DeviceError, Measurement, Written};
use rtrb::{Consumer, Producer};

/// A device that has been greeted.
///
/// Neither method waits, allocates or locks. [`DeviceError::Disconnected`] ends the connection.
pub trait Connection: Send {
    /// The newest sample; nothing before the first.
    ///
    /// # Errors
    /// As [`Device::read`].
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError>;

    /// Commands a force on the hand, N, as [`Device::write`].
    ///
    /// # Errors
    /// As [`Device::write`].
    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError>;

    /// Distance between two counts, m.
    fn resolution_m(&self) -> f64;
}

/// A connection on its way to the real-time thread.
pub(crate) struct Handover {
    connection: Box<dyn Connection>,
    force_limit_n: f64,
}

/// The real-time end of a link.
pub struct LinkDevice {
    address: String,
    connection: Option<Box<dyn Connection>>,
    greeted: Consumer<Handover>,
    failed: Producer<Box<dyn Connection>>,
    /// Connections taken so far.
    connections: u64,
    resolution_m: f64,
    force_limit_n: f64,
    now_ns: u64,
}

impl std::fmt::Debug for LinkDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LinkDevice")
            .field("address", &self.address)
            .finish_non_exhaustive()
    }
}

impl LinkDevice {
    /// Does something with the connection; one that has failed goes back to the keeper.
    fn with<T>(&mut self, act: impl FnOnce(&mut dyn Connection) -> Result<T, DeviceError>) -> Result<T, DeviceError> {
        let Some(connection) = self.connection.as_deref_mut() else {
            return Err(DeviceError::Disconnected);
        };
        let done = act(connection);
        if matches!(done, Err(DeviceError::Disconnected))
            && let Some(failed) = self.connection.take()
            && let Err(rtrb::PushError::Full(failed)) = self.failed.push(failed)
        {
            // There is room for as many as the keeper makes before it has taken one back; were there none, it must not be dropped here.
            self.connection = Some(failed);
        }
        done
    }
}

impl Device for LinkDevice {
    fn description(&self) -> String {
        self.address.clone()
    }

    fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    fn force_limit_n(&self) -> f64 {
        self.force_limit_n
    }

    fn is_linked(&self) -> bool {
        true
    }

    fn connection(&self) -> u64 {
        self.connections
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        self.now_ns = now_ns;
        if self.connection.is_none()
            && let Ok(Handover {
                connection,
                force_limit_n,
            }) = self.greeted.pop()
        {
            self.connections += 1;
            self.resolution_m = connection.resolution_m();
            self.force_limit_n = force_limit_n;
            self.connection = Some(connection);
        }
        self.with(|connection| connection.read(now_ns))?
            .ok_or(DeviceError::Disconnected)
    }

    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError> {
        let now_ns = self.now_ns;
        self.with(|connection| connection.write(force_n, enabled, now_ns))
    }
}
