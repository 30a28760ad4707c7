//! What a device says, sample by sample.

use core::fmt;
use thiserror::Error;

/// One sample of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement<V = f64> {
    /// Counts the samples; the same number again is the same sample. It wraps around.
    pub sequence: u32,
    /// When it was taken, on the device's own clock, ns.
    pub time_ns: u64,
    /// Position of the handle, m.
    pub position_m: V,
    /// What the motor does, as far as the device reports it.
    pub motor: Motor,
    /// Buttons pressed, one bit each.
    pub buttons: u8,
}

impl<V> Measurement<V> {
    /// The same with another position.
    #[must_use]
    pub fn at<W>(&self, position_m: W) -> Measurement<W> {
        Measurement {
            sequence: self.sequence,
            time_ns: self.time_ns,
            position_m,
            motor: self.motor,
            buttons: self.buttons,
        }
    }

    /// A sample of a device without buttons that does not report its motor.
    #[must_use]
    pub fn new(sequence: u32, time_ns: u64, position_m: V) -> Self {
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
#[repr(u8)]
pub enum Motor {
    /// The device does not report it: a command counts as carried out once it is written.
    Unreported = 0,
    /// It is enabled.
    Enabled = 1,
    /// It is off, but the device has not yet confirmed the newest order to switch it off.
    Unconfirmed = 2,
    /// It is off, and the device has confirmed the newest order to switch it off.
    Off = 3,
}

impl Motor {
    /// All of them, by their numbers.
    pub(crate) const ALL: [Self; 4] = [Self::Unreported, Self::Enabled, Self::Unconfirmed, Self::Off];
}

/// Why a rig could not be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum DeviceError {
    /// The rig is no longer there.
    #[error("the device is disconnected")]
    Disconnected,
    /// The rig is there, and its motor is off though it was enabled.
    #[error("the device has its motor off{}", if *.watchdog { ": its watchdog received no command for too \
                                                               long" } else { "" })]
    MotorOff {
        /// Whether its own watchdog switched it off.
        watchdog: bool,
    },
    /// The rig is there, and confirms none of the commands that it is sent.
    #[error("the device sends samples and confirms no command")]
    CommandsIgnored,
    /// The rig is there, and confirms commands too long after they were sent.
    #[error("the device confirms commands too late")]
    CommandsLate,
    /// The rig is there and reports an error.
    #[error("{0}")]
    Failed(ErrorReport),
}

/// What is wrong with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ErrorCode {
    /// A message whose kind, version or length it does not know.
    BadMessage = 1,
    /// The position sensor fails, or the handle moves faster than it can follow.
    Sensor = 2,
    /// The motor or its amplifier fails: too hot, too much current.
    Motor = 3,
    /// Anything else.
    Other = 255,
}

impl ErrorCode {
    /// The code with a number; an unknown number is [`Other`](Self::Other).
    #[must_use]
    pub fn from_byte(byte: u8) -> Self {
        match byte {
            1 => Self::BadMessage,
            2 => Self::Sensor,
            3 => Self::Motor,
            _ => Self::Other,
        }
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BadMessage => "it was sent a message that it does not know",
            Self::Sensor => "its position sensor fails, or the handle moved faster than its encoder can follow",
            Self::Motor => "its motor or amplifier fails",
            Self::Other => "it reports an error of its own",
        })
    }
}

/// An error that a device reports. Packed, as each tick's record has room for one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, packed)]
pub struct ErrorReport {
    /// What is wrong.
    pub code: ErrorCode,
    /// What the firmware's maker wants to know.
    pub detail: u32,
}

impl From<ErrorCode> for ErrorReport {
    /// Without a detail.
    fn from(code: ErrorCode) -> Self {
        Self { code, detail: 0 }
    }
}

impl fmt::Display for ErrorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { code, detail } = *self;
        write!(f, "{code} (code {}, detail {detail} = {detail:#x})", code as u8)
    }
}
