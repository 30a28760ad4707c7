//! All that a soak has seen of one daemon, from which its report is made.

use super::round::Occurrence;
use super::{health, load, recordings, rig};

/// All that was seen of one daemon.
#[derive(Debug)]
pub(super) struct Seen {
    pub(super) rig: &'static str,
    pub(super) occurrences: Vec<Occurrence>,
    pub(super) left_out: Vec<String>,
    pub(super) load: load::Heard,
    pub(super) recordings: recordings::Checked,
    pub(super) health: health::History,
    pub(super) force: rig::ForceRecord,
    /// What never ended or ended in a panic.
    pub(super) broken: Vec<String>,
}
