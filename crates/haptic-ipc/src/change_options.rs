//! How a scene changes: what every change of it has in common.

use crate::fields::fields;
use crate::object::Limits;

/// Ramps, ms.
pub(crate) const RAMP: Limits = Limits::new(0, 10_000);

fields! {
    /// How a scene changes.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub struct ChangeOptions {} optional {
        /// Refuse unless this is the newest revision.
        if_revision: Option<u64>,
        /// Time over which to change, ms; at once when absent.
        ramp_ms: Option<f64> where RAMP,
        /// Answer with what would happen, and change nothing.
        dry_run: bool,
        /// The tick that is to render it first; the next one when absent.
        at_tick: Option<u64>,
        /// Change to a scene that would chatter on this rig, too: for this request alone.
        anyway: bool,
    }
}
