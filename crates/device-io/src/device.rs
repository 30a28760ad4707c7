//! The interface of every rig, and the clock that it is read by.

pub use haptic_core::sample::{DeviceError, Measurement, Motor};
use rustix::time::{ClockId, clock_gettime};

/// The monotonic clock, ns.
#[must_use]
pub fn now_ns() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    u64::try_from(time.tv_sec).unwrap_or(0) * 1_000_000_000 + u64::try_from(time.tv_nsec).unwrap_or(0)
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// The whole command has left this process, and so has every command before it. On a serial
    /// line the system has it, and passes it on as fast as the line goes; on HID the transfer has
    /// ended; a rig in this process has carried it out. The rig's samples say whether it obeys.
    Taken,
    /// The link is busy, and has taken a part of the command or nothing. Command it again in the
    /// next tick, as every force.
    Later,
}

/// What the loop must know of a rig beside its samples. Another connection may be another rig, with other bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceBounds {
    /// Number of the connection, from 1, for a rig behind a link; 0 before the first, and without a link.
    pub connection: u64,
    /// Whether the rig is behind a link: then the time for reading and writing matters.
    pub is_linked: bool,
    /// Distance between two positions that the rig can distinguish, m; 0 for a perfect rig.
    pub resolution_m: f64,
    /// Largest force of the rig, N; infinite for a rig without a limit.
    pub force_limit_n: f64,
}

impl Default for DeviceBounds {
    /// A perfect rig without a link.
    fn default() -> Self {
        Self {
            connection: 0,
            is_linked: false,
            resolution_m: 0.0,
            force_limit_n: f64::INFINITY,
        }
    }
}

/// A rig, as the real-time loop uses it: of one axis, or of two that move a hand in a plane.
///
/// No method but [`Self::description`] may allocate, lock or wait longer than the link needs.
/// Dropping a device leaves it at zero force.
pub trait Device<V = f64>: Send {
    /// What the rig is, for people.
    fn description(&self) -> String;

    /// What it can distinguish and give, and on which connection. Only reading it may change them.
    fn bounds(&self) -> DeviceBounds;

    /// Reads the newest sample. `now_ns` is the host's monotonic clock; a rig with a clock of its
    /// own needs it only for the age of its sample.
    ///
    /// # Errors
    /// The rig could not be read. The caller must not render an older position in its place.
    fn read(&mut self, now_ns: u64) -> Result<Measurement<V>, DeviceError>;

    /// Commands the force on the hand, N, until the next command. A motor that is not `enabled`
    /// must not be driven, and is switched off by a rig that can. The result says whether the
    /// device has taken the command; a command that repeats the one of the tick before counts as
    /// taken once the first of them was.
    ///
    /// # Errors
    /// The rig could not be written.
    fn write(&mut self, force_n: V, enabled: bool) -> Result<Written, DeviceError>;
}
