//! `log`: the newest entries of the journal.

use crate::control::RigHandle;
use haptic_ipc::LogReply;

/// Default number of entries in an answer: a line with more is hard to read.
const DEFAULT_LIMIT: usize = 100;

pub(super) fn log(rig: &RigHandle, after: Option<u64>, limit: Option<usize>) -> LogReply {
    rig.journal(after.unwrap_or(0), limit.unwrap_or(DEFAULT_LIMIT))
}
