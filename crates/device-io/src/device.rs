//! The interface of every rig.

use crate::protocol::message::ErrorReport;
use thiserror::Error;

/// One sample of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Number of the sample; a repeated number is the same sample.
    pub sequence: u32,
    /// Time of the sample on the device's own clock, ns.
    pub time_ns: u64,
    /// Position of the handle, m.
    pub position_m: f64,
    /// State of the motor, as far as the device reports it.
    pub motor: Motor,
    /// Buttons pressed, one bit each.
    pub buttons: u8,
}

impl Measurement {
    /// A sample of a device that has no buttons and does not report its motor.
    #[must_use]
    pub fn new(sequence: u32, time_ns: u64, position_m: f64) -> Self {
        Self {
            sequence,
            time_ns,
            position_m,
            motor: Motor::Unreported,
            buttons: 0,
        }
    }
}

/// The motor, as a device reports it in its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motor {
    /// The device does not report it: a written command counts as carried out.
    Unreported,
    /// It is enabled.
    Enabled,
    /// It is off, but the device has not yet confirmed that it heard the newest order to switch it
    /// off.
    Unconfirmed,
    /// It is off, and the device has confirmed the newest order to switch it off.
    Off,
}

/// Why a rig could not be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The rig is no longer there.
    #[error("the device is disconnected")]
    Disconnected,
    /// The rig is there, and its motor is off though it was enabled.
    #[error("the device has its motor off{}", if *.watchdog { ": its watchdog heard no command for too long" } else { "" })]
    MotorOff {
        /// Whether its own watchdog switched it off.
        watchdog: bool,
    },
    /// The rig is there and reports an error.
    #[error("{0}")]
    Failed(ErrorReport),
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

/// A one-axis rig, as the real-time loop uses it.
///
/// No method but [`Self::description`] may allocate, lock or wait longer than the link needs.
/// Dropping a device leaves it at zero force.
pub trait Device: Send {
    /// What the rig is, for people.
    fn description(&self) -> String;

    /// Distance between two positions that the rig can tell apart, m; 0 for a perfect rig. It may
    /// change while the rig is disconnected.
    fn resolution_m(&self) -> f64;

    /// Largest force of the rig, N; infinite for a rig without a limit. It may change while the rig
    /// is disconnected.
    fn force_limit_n(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether the rig is behind a link: then the time for reading and writing matters.
    fn is_linked(&self) -> bool {
        false
    }

    /// Number of the present connection, from 1, for a rig behind a link. Another number may be
    /// another device.
    fn connection(&self) -> u64 {
        0
    }

    /// Reads the newest sample. `now_ns` is the host's monotonic clock; a rig with a clock of its
    /// own needs it only for the age of its sample.
    ///
    /// # Errors
    /// The rig could not be read. The caller must not render an older position in its place.
    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError>;

    /// Commands the force on the hand, N, until the next command. A motor that is not `enabled`
    /// must not be driven, and is switched off by a rig that can. The result says whether the
    /// device has taken the command; a command that repeats the one of the tick before counts as
    /// taken once the first of them was.
    ///
    /// # Errors
    /// The rig could not be written.
    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError>;
}
