//! The states of the rig.

use serde::{Deserialize, Serialize};
use std::fmt;

/// State of the rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum RigState {
    /// No device; zero force.
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

/// Answer to `engage`, `release`, `stop` and `reset`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateReply {
    /// State of the rig after the tick.
    pub state: RigState,
    /// The tick that carried it out.
    pub tick: u64,
}
