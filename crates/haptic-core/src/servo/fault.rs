//! Why a check took the force away.

use crate::sample::{ErrorCode, ErrorReport};
use crate::sample_clock::ClockError;
use core::fmt;

/// Why a check took the force away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The force computed was not a finite number.
    NonFiniteForce,
    /// The device reported a position that is not a finite number.
    NonFinitePosition,
    /// The device moved faster than the rig allows.
    TooFast,
    /// More periods were missed in a second than the policy allows.
    TooLate,
    /// The device sent no new sample for too long.
    Stale,
    /// The position changed as no rig can move.
    Jump,
    /// The device has its motor off, though it was enabled.
    MotorOff {
        /// Its own watchdog has done that.
        watchdog: bool,
    },
    /// The device sends samples and confirms no command, for as long as its watchdog waits.
    CommandsIgnored,
    /// A command was longer on its way to the device and back than a sample may be old.
    CommandsLate,
    /// The device says that something is wrong with it.
    Device(ErrorReport),
    /// The device's clock cannot be one.
    DeviceClock(ClockError),
    /// The loop stood still for longer than a sample may be old, or the machine slept.
    Stalled,
    /// The control thread has given no sign of life for too long.
    ControlLost,
    /// Not a fault, but a stop, by the rig's own button.
    StopButton,
    /// The device has its motor on, or does not confirm that it is off, long after the command
    /// switch it off.
    StillEnabled,
}

impl Fault {
    /// One of each kind.
    pub const KINDS: [Self; 15] = [
        Self::NonFiniteForce,
        Self::NonFinitePosition,
        Self::TooFast,
        Self::TooLate,
        Self::Stale,
        Self::Jump,
        Self::MotorOff { watchdog: true },
        Self::CommandsIgnored,
        Self::CommandsLate,
        Self::Device(ErrorReport {
            code: ErrorCode::Other,
            detail: 0,
        }),
        Self::DeviceClock(ClockError::Jumped),
        Self::Stalled,
        Self::ControlLost,
        Self::StopButton,
        Self::StillEnabled,
    ];

    /// Its name for machines: monitoring counts by it.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::NonFiniteForce => "non_finite_force",
            Self::NonFinitePosition => "non_finite_position",
            Self::TooFast => "too_fast",
            Self::TooLate => "too_late",
            Self::Stale => "stale",
            Self::Jump => "jump",
            Self::MotorOff { .. } => "motor_off",
            Self::CommandsIgnored => "commands_ignored",
            Self::CommandsLate => "commands_late",
            Self::Device(_) => "device",
            Self::DeviceClock(_) => "device_clock",
            Self::Stalled => "stalled",
            Self::ControlLost => "control_lost",
            Self::StopButton => "stop_button",
            Self::StillEnabled => "still_enabled",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Jump => "the position jumped: it changed faster than the acceleration limit allows",
            Self::Stale => "the device sent no new sample for too long",
            Self::MotorOff { watchdog: false } => "the device has switched its motor off",
            Self::MotorOff { watchdog: true } => {
                "the device's watchdog has switched its motor off: it heard no command"
            }
            Self::CommandsIgnored => {
                "commands_ignored: the device sends samples, and for as long as its watchdog waits it has confirmed no \
                 command"
            }
            Self::CommandsLate => {
                "commands_late: a command took longer than stale-ms and a sample period to the device and back: the \
                 line or the device carries less than the loop sends"
            }
            Self::Device(code) => return write!(f, "the device reports: {code}"),
            Self::DeviceClock(error) => return write!(f, "device_clock: the device's time cannot be right: {error}"),
            Self::StopButton => "stop_button: the rig's own stop button was pressed",
            Self::Stalled => "stalled: the loop stood still for longer than stale-ms while force flowed",
            Self::ControlLost => {
                "control_lost: no stop could be heard, as the control thread hung or nobody could reach its socket; the force was \
                 let down"
            }
            Self::StillEnabled => {
                "still_enabled: the device has not switched its motor off 100 ms after it was told to: cut its power"
            }
            Self::NonFiniteForce => "the force computed was not a finite number",
            Self::NonFinitePosition => "the device reported a position that is not a finite number",
            Self::TooFast => "the device moved faster than its speed limit",
            Self::TooLate => "more periods were missed in a second than the late policy allows",
        })
    }
}
