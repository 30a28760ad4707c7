//! `timing`: how well the loop keeps time.

use crate::control::RigHandle;
use haptic_ipc::Timing;

pub(super) fn timing(rig: &RigHandle) -> Timing {
    rig.feed().timing_report()
}
