//! `log`: who changed what, and when.

use crate::control::RigHandle;
use haptic_ipc::LogReply;

/// Entries in an answer unless more are asked for. With more the line would soon be too long to be
/// read with ease.
const DEFAULT_LIMIT: usize = 100;

pub(super) fn log(rig: &RigHandle, after: Option<u64>, limit: Option<usize>) -> LogReply {
    rig.journal(after.unwrap_or(0), limit.unwrap_or(DEFAULT_LIMIT))
}
