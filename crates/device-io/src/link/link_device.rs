//! The real-time end of a link: the device behind the newest connection of the keeper.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::Connection;
use crate::device::{Device, DeviceError, Measurement, Written};
use rtrb::{Consumer, Producer};

/// A connection on its way to the real-time thread.
pub(super) struct Handover {
    pub(super) connection: Box<dyn Connection>,
    pub(super) force_limit_n: f64,
    pub(super) resolution_m: f64,
}

/// The real-time end of a link.
pub struct LinkDevice {
    address: String,
    connection: Option<Box<dyn Connection>>,
    greeted: Consumer<Handover>,
    failed: Producer<Box<dyn Connection>>,
    /// Number of connections so far.
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
    /// A device without a connection yet. It takes connections from one ring, and returns failed
    /// ones through the other.
    pub(super) fn new(address: String, greeted: Consumer<Handover>, failed: Producer<Box<dyn Connection>>) -> Self {
        Self {
            address,
            connection: None,
            greeted,
            failed,
            connections: 0,
            resolution_m: 0.0,
            force_limit_n: f64::INFINITY,
            now_ns: 0,
        }
    }

    /// Uses the connection. A failed connection goes back to the keeper.
    fn with<T>(&mut self, act: impl FnOnce(&mut dyn Connection) -> Result<T, DeviceError>) -> Result<T, DeviceError> {
        let Some(connection) = self.connection.as_deref_mut() else {
            return Err(DeviceError::Disconnected);
        };
        let done = act(connection);
        if matches!(done, Err(DeviceError::Disconnected))
            && let Some(failed) = self.connection.take()
            && let Err(rtrb::PushError::Full(failed)) = self.failed.push(failed)
        {
            // There is room for all connections that the keeper makes before it takes one back.
            // Without room the connection must not be dropped here.
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
                resolution_m,
            }) = self.greeted.pop()
        {
            self.connections += 1;
            self.resolution_m = resolution_m;
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
