//! What an analysis refuses to say.

use serde::Serialize;

/// Something that the trials do not show, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refusal {
    /// What it is.
    pub what: String,
    /// Why.
    pub reason: String,
}
