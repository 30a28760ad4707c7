//! `engage`, `release`, `reset` and `stop`: what moves the rig from state to state.

use crate::control::RigHandle;
use crate::rig_state::Command;
use haptic_ipc::{StateReply, WireError};

pub(super) async fn command(rig: &RigHandle, command: Command) -> Result<StateReply, WireError> {
    let outcome = rig.command(command).await?;
    Ok(StateReply {
        state: outcome.state,
        tick: outcome.tick,
    })
}

pub(super) async fn stop(rig: &RigHandle) -> Result<StateReply, WireError> {
    let (tick, state) = rig.stop().await?;
    Ok(StateReply { state, tick })
}
