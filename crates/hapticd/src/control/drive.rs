//! `engage`, `release`, `reset` and `stop`: the changes of the rig's state.

use crate::control::RigHandle;
use crate::control::requester::Requester;
use haptic_core::servo::Command;
use haptic_ipc::{StateReply, WireError};

pub(super) async fn command(
    rig: &RigHandle,
    command: Command,
    stops_known: u64,
    by: Requester<'_>,
) -> Result<StateReply, WireError> {
    let outcome = rig.command(command, stops_known, by).await?;
    Ok(StateReply {
        state: outcome.state,
        tick: outcome.tick,
    })
}

/// Answers a stop, which was raised when its line was read.
pub(super) async fn stopped(rig: &RigHandle, stop: u64) -> Result<StateReply, WireError> {
    let (tick, state) = rig.stopped(stop).await?;
    Ok(StateReply { state, tick })
}
