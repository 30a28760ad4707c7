//! Changes of the rig's state that no client asked for, as the records of its ticks show them.

use crate::rt::outbox::TickRecord;
use haptic_core::servo::Fault;
use haptic_ipc::RigState;

/// State and fault of the newest record, and whether the rig's enable button is let go of in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ObservedState {
    state: Option<RigState>,
    fault: Option<Fault>,
    is_enable_button_open: bool,
}

impl ObservedState {
    /// What a record shows of a rig that force wants this button for, by its bit.
    pub(super) fn of(record: &TickRecord, enable_button: Option<u8>) -> Self {
        Self {
            state: Some(record.state),
            fault: record.fault,
            is_enable_button_open: enable_button.is_some_and(|button| !record.input_word.is_pressed(button)),
        }
    }

    /// An event that no client asked for: the name of its journal entry, and its message.
    pub(super) fn change_since(self, before: Self) -> Option<(&'static str, String)> {
        if let Some(fault) = self.fault.filter(|_| self.fault != before.fault) {
            let op = if self.state == Some(RigState::Faulted) {
                "fault"
            } else {
                "stop"
            };
            return Some((op, fault.to_string()));
        }
        // A ramp that is over within a tick leads from force to idle, too: the client that asked for it, or the lease
        // that lapsed, has an entry of its own.
        let had_force = matches!(before.state, Some(RigState::Engaging | RigState::Engaged));
        (had_force && self.state == Some(RigState::Idle) && self.is_enable_button_open)
            .then(|| ("release", "the rig's enable button was released".to_owned()))
    }
}
