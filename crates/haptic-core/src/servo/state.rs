//! The states of the rig, and the commands that change them.

use core::fmt;

/// State of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
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
