//! The hand on the fake rig, as a client moves it.

use serde::{Deserialize, Serialize};

/// Answer to `hand`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HandReply {
    /// Time without another `hand` after which the arm has let go, ms.
    pub lets_go_after_ms: u32,
}
