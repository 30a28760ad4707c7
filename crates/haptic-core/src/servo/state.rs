//! The states of the rig, and the commands that change them.
//!
//! Beside them, why a check took the force away.

use crate::sample::{ErrorCode, ErrorReport};
use crate::sample_clock::ClockError;
use core::fmt;

/// State of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum RigState {
    /// No device; zero force.
    #[default]
    Disconnected,
    /// Zero force.
    Idle,
    /// The force ramps up.
    Engaging,
    /// The scene is rendered.
    Engaged,
    /// The force ramps down.
    Releasing,
    /// Zero force, by a person; needs a reset.
    Stopped,
    /// Zero force, by a check; needs a reset.
    Faulted,
}

impl RigState {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Disconnected,
        Self::Idle,
        Self::Engaging,
        Self::Engaged,
        Self::Releasing,
        Self::Stopped,
        Self::Faulted,
    ];

    /// Whether force may flow: while engaging, engaged or releasing.
    #[must_use]
    pub const fn is_live(self) -> bool {
        matches!(self, Self::Engaging | Self::Engaged | Self::Releasing)
    }
}

impl fmt::Display for RigState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Disconnected => "disconnected",
            Self::Idle => "idle",
            Self::Engaging => "engaging",
            Self::Engaged => "engaged",
            Self::Releasing => "releasing",
            Self::Stopped => "stopped",
            Self::Faulted => "faulted",
        })
    }
}

/// What a person may ask of the rig. A stop is not a command: it overtakes every command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Let the force in.
    Engage = 1,
    /// Let the force out.
    Release = 2,
    /// Leave the state that a stop or a fault brought.
    Reset = 3,
}

impl Command {
    /// Its number in a record and between the threads: 1, 2 or 3.
    #[must_use]
    #[inline]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The command with a number, if there is one.
    #[must_use]
    #[inline]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            1 => Some(Self::Engage),
            2 => Some(Self::Release),
            3 => Some(Self::Reset),
            _ => None,
        }
    }

    /// Its name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Engage => "engage",
            Self::Release => "release",
            Self::Reset => "reset",
        }
    }
}

/// One row gives a fault: what it is, one of its kind, its name for machines, and its id in the journal of systemd, a
/// random number that stays for ever.
macro_rules! faults {
    ($($(#[$about:meta])+ $name:ident $({ $(#[$about_field:meta])+ $field:ident: $kind:ty })? $(($of:ty))?
        => $one:expr, $code:literal, $message_id:literal;)+) => {
        /// Why a check took the force away.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Fault {
            $($(#[$about])+ $name $({ $(#[$about_field])+ $field: $kind })? $(($of))?,)+
        }

        impl Fault {
            /// One of each kind.
            pub const KINDS: [Self; [$($code),+].len()] = [$($one),+];

            /// Its name for machines: monitoring counts by it.
            #[must_use]
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$name { .. } => $code,)+
                }
            }

            /// Its id in the journal of systemd, by its [`code`](Self::code).
            #[must_use]
            pub fn message_id(code: &str) -> Option<&'static str> {
                match code {
                    $($code => Some($message_id),)+
                    _ => None,
                }
            }
        }
    };
}

faults! {
    /// The force computed was not a finite number.
    NonFiniteForce => Self::NonFiniteForce, "non_finite_force", "4132e051f8805854b6257864d2cf92b6";
    /// The device reported a position that is not a finite number.
    NonFinitePosition => Self::NonFinitePosition, "non_finite_position", "db91467b55925f7980d222b7058b7f27";
    /// The device moved faster than the rig allows.
    TooFast => Self::TooFast, "too_fast", "c24a5fac5f8558ab867856dca20afa92";
    /// More periods were missed in a second than the policy allows.
    TooLate => Self::TooLate, "too_late", "81633f76dbd655c9a5aa23facea003b7";
    /// The device sent no new sample for too long.
    Stale => Self::Stale, "stale", "7f76a791895251f19f7c005b7fc3ec10";
    /// The position changed as no rig can move.
    Jump => Self::Jump, "jump", "d690fb319b415a52a5fb20db56a58ad8";
    /// The device has its motor off, though it was enabled.
    MotorOff {
        /// Its own watchdog has done that.
        watchdog: bool
    } => Self::MotorOff { watchdog: true }, "motor_off", "7440e7d6874958fa91c9eb34a0e32ff7";
    /// The device sends samples and confirms no command, for as long as its watchdog waits.
    CommandsIgnored => Self::CommandsIgnored, "commands_ignored", "a6b10147c1d04486abc3de6af369c408";
    /// A command was longer on its way to the device and back than a sample may be old.
    CommandsLate => Self::CommandsLate, "commands_late", "c98f2d0fdc13494e89b2be84079afa9f";
    /// The device says that something is wrong with it.
    Device(ErrorReport) => Self::Device(ErrorReport { code: ErrorCode::Other, detail: 0 }), "device", "809c5b3ed5745078a0ab80ed806b2f4f";
    /// The device's clock cannot be one.
    DeviceClock(ClockError) => Self::DeviceClock(ClockError::Jumped), "device_clock", "612e76c8ad655ee1aab0ed83e2e3d566";
    /// The loop stood still for longer than a sample may be old, or the machine slept.
    Stalled => Self::Stalled, "stalled", "a4b3f8073e62507aaca8c871affe9bc7";
    /// The control thread has given no sign of life for too long.
    ControlLost => Self::ControlLost, "control_lost", "38ffecccd496544e87ddef014bcb4086";
    /// Not a fault, but a stop, by the rig's own button.
    StopButton => Self::StopButton, "stop_button", "866424ab51bf549696ebbb6475453709";
    /// The device has its motor on, or does not confirm that it is off, long after the command to
    /// switch it off.
    StillEnabled => Self::StillEnabled, "still_enabled", "01f20b4fecc556ea98b8b2af5e7d4a83";
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.code())?;
        f.write_str(match self {
            Self::Jump => "the position jumped: as no hand moves it, or beyond the acceleration limit",
            Self::Stale => "the device sent no new sample for too long",
            Self::MotorOff { watchdog: false } => "the device has switched its motor off",
            Self::MotorOff { watchdog: true } => {
                "the device's watchdog has switched its motor off: it received no command; `haptic-ctl timing` shows whether the \
                 loop was late, and `haptic-ctl status` what the link lost"
            }
            Self::CommandsIgnored => {
                "the device sends samples, and for as long as its watchdog waits it has confirmed no \
                 command"
            }
            Self::CommandsLate => {
                "a command took longer than stale-ms and a sample period to the device and back: the \
                 line or the device carries less than the loop sends"
            }
            Self::Device(code) => return write!(f, "the device reports: {code}"),
            Self::DeviceClock(error) => return write!(f, "the device's time cannot be right: {error}"),
            Self::StopButton => "the rig's own stop button was pressed",
            Self::Stalled => "the loop stood still for longer than stale-ms while force flowed",
            Self::ControlLost => {
                "no stop could be received: the machine gave the control thread no time, it hung, or nobody could \
                 reach its socket; the force was let down; `haptic-ctl doctor` checks the machine and the socket"
            }
            Self::StillEnabled => {
                "the device has not switched its motor off 100 ms after it was told to: cut its power"
            }
            Self::NonFiniteForce => "the force computed was not a finite number",
            Self::NonFinitePosition => "the device reported a position that is not a finite number",
            Self::TooFast => "the device moved faster than its speed limit",
            Self::TooLate => "more periods were missed in a second than the late policy allows",
        })
    }
}
