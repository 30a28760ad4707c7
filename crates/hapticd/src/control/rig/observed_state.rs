//! Changes of the rig's state that no client asked for, as the records of its ticks show them.

use crate::rt::outbox::TickRecord;
use haptic_core::servo::Fault;
use haptic_ipc::RigState;

/// State and fault of the newest record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ObservedState {
    state: Option<RigState>,
    fault: Option<Fault>,
}

impl ObservedState {
    pub(super) fn of(record: &TickRecord) -> Self {
        Self {
            state: Some(record.state),
            fault: record.fault,
        }
    }

    /// An event that no client asked for: the name of its journal entry, and its message.
    pub(super) fn news_since(self, before: Self) -> Option<(&'static str, String)> {
        if let Some(fault) = self.fault.filter(|_| self.fault != before.fault) {
            let op = if self.state == Some(RigState::Faulted) {
                "fault"
            } else {
                "stop"
            };
            return Some((op, fault.to_string()));
        }
        // Only the enable button leads from force to idle without a ramp.
        let had_force = matches!(before.state, Some(RigState::Engaging | RigState::Engaged));
        (had_force && self.state == Some(RigState::Idle))
            .then(|| ("release", "the rig's enable button was released".to_owned()))
    }
}
