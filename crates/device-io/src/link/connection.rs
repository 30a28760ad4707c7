//! A device that has been greeted, as the real-time thread uses it.

use crate::device::{DeviceError, Measurement, Written};

/// A device after its greeting.
///
/// Neither method waits, allocates or locks. [`DeviceError::Disconnected`] ends the connection.
pub trait Connection: Send {
    /// The newest sample; nothing before the first.
    ///
    /// # Errors
    /// As [`Device::read`](crate::Device::read).
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError>;

    /// Commands a force on the hand, N, as [`Device::write`](crate::Device::write).
    ///
    /// # Errors
    /// As [`Device::write`](crate::Device::write).
    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError>;
}
