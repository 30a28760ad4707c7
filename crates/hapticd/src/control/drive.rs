//! `engage`, `release`, `reset` and `stop`: the changes of the rig's state.

use crate::control::RigHandle;
use crate::control::peer::Requester;
use crate::rt::handoff::Outcome;
use haptic_core::servo::Command;
use haptic_ipc::{StateReply, WireError};

pub(super) async fn engage(
    rig: &RigHandle,
    anyway: bool,
    stops_known: u64,
    by: Requester<'_>,
) -> Result<StateReply, WireError> {
    rig.engage(anyway, stops_known, by).await.map(reply)
}

pub(super) async fn command(
    rig: &RigHandle,
    command: Command,
    stops_known: u64,
    by: Requester<'_>,
) -> Result<StateReply, WireError> {
    rig.command(command, stops_known, by).await.map(reply)
}

fn reply(outcome: Outcome) -> StateReply {
    StateReply {
        state: outcome.state,
        tick: outcome.tick,
    }
}

/// Answers a stop, which was raised when its line was read.
pub(super) async fn stopped(rig: &RigHandle, stop: u64) -> Result<StateReply, WireError> {
    let (tick, state) = rig.stopped(stop).await?;
    Ok(StateReply { state, tick })
}
