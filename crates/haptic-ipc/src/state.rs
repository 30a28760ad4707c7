//! The states of the rig on the wire.

pub use haptic_core::servo::RigState;
use serde::{Deserialize, Serialize};

/// Answer to `engage`, `release`, `stop` and `reset`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StateReply {
    /// State of the rig after that tick.
    pub state: RigState,
    /// The tick that carried it out.
    pub tick: u64,
}
