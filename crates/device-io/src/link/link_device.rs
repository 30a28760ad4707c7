//! The real-time end of a link: the device behind the newest connection of the keeper.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::Connection;
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use rtrb::{Consumer, Producer};

/// A connection on its way to the real-time thread, and the bounds of the device behind it.
pub(super) type Handover = (Box<dyn Connection>, DeviceBounds);

/// The real-time end of a link.
#[derive(Debug)]
pub struct LinkDevice {
    address: String,
    connection: Option<Box<dyn Connection>>,
    greeted: Consumer<Handover>,
    failed: Producer<Box<dyn Connection>>,
    /// Those of the newest connection.
    bounds: DeviceBounds,
    now_ns: u64,
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
            bounds: DeviceBounds {
                is_linked: true,
                ..DeviceBounds::default()
            },
            now_ns: 0,
        }
    }

    /// The newest sample of the newest connection, with the position of each motor, at a time of ours, ns.
    pub(super) fn read_motors(&mut self, now_ns: u64) -> Result<Measurement<[f64; 2]>, DeviceError> {
        self.now_ns = now_ns;
        if self.connection.is_none()
            && let Ok((connection, bounds)) = self.greeted.pop()
        {
            self.bounds = bounds;
            self.connection = Some(connection);
        }
        self.with(|connection, now_ns| connection.read(now_ns))?
            .ok_or(DeviceError::Disconnected)
    }

    /// Commands the efforts of the motors, at the time of the last reading.
    pub(super) fn write_motors(&mut self, efforts: [f64; 2], enabled: bool) -> Result<Written, DeviceError> {
        self.with(|connection, now_ns| connection.write(efforts, enabled, now_ns))
    }

    /// Uses the connection. A failed connection goes back to the keeper.
    fn with<T>(
        &mut self,
        act: impl FnOnce(&mut dyn Connection, u64) -> Result<T, DeviceError>,
    ) -> Result<T, DeviceError> {
        let Some(connection) = self.connection.as_deref_mut() else {
            return Err(DeviceError::Disconnected);
        };
        let done = act(connection, self.now_ns);
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

    fn bounds(&self) -> DeviceBounds {
        self.bounds
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        let measured = self.read_motors(now_ns)?;
        Ok(measured.at(measured.position_m[0]))
    }

    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError> {
        self.write_motors([force_n, 0.0], enabled)
    }
}
