//! The hand on the fake rig, as a client moves it.

use serde::{Deserialize, Serialize};

/// Answer to `hand`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HandReply {
    /// Time without another `hand` of this client after which the arm has let go of the handle, ms.
    pub lets_go_after_ms: u32,
}
