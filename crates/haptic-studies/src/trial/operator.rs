//! Who did a trial.

use serde::{Deserialize, Serialize};

/// Who did a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Operator {
    /// A person.
    Human,
    /// A model of one. Its trials say nothing about people.
    Simulated,
}
