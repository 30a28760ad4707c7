//! What keeps the rig or the real-time thread from what it should be, and the remedy.

use serde::{Deserialize, Serialize};

/// Something that is wrong, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Problem {
    /// What it is, and what the system said.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}
