//! `timing`: the timing of the loop.

use crate::control::RigHandle;
use haptic_ipc::Timing;

pub(super) fn timing(rig: &RigHandle) -> Timing {
    rig.feed().timing_report()
}
