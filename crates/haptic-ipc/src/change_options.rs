//! How a scene changes: what every change of it has in common.

use crate::error::WireError;
use crate::object::{Limits, Object};
use serde::Serialize;

/// Ramps, ms.
pub(crate) const RAMP: Limits = Limits::new(0, 10_000);

/// How a scene changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChangeOptions {
    /// Refuse unless this is the newest revision.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_revision: Option<u64>,
    /// Time over which to change, ms; at once when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = RAMP.smallest(), max = RAMP.max)))]
    pub ramp_ms: Option<f64>,
    /// Answer with what would happen, and change nothing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub dry_run: bool,
    /// The tick that is to render it first; the next one when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_tick: Option<u64>,
}

impl ChangeOptions {
    pub(crate) const FIELDS: [&str; 4] = ["if_revision", "ramp_ms", "dry_run", "at_tick"];

    pub(crate) fn read(line: &Object<'_>) -> Result<Self, WireError> {
        Ok(Self {
            if_revision: line.optional("if_revision", None)?,
            ramp_ms: line.optional("ramp_ms", Some(RAMP))?,
            dry_run: line.optional("dry_run", None)?,
            at_tick: line.optional("at_tick", None)?,
        })
    }
}
