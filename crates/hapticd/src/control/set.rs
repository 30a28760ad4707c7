//! `set`: change parameters, all of them or none, between two ticks.

use crate::control::{RigHandle, advise};
use haptic_ipc::{ChangeReply, Changes, WireError};

pub(super) async fn set(rig: &RigHandle, params: &Changes) -> Result<ChangeReply, WireError> {
    let changes = params.resolve()?;
    let scene = rig.scene().with(&changes)?;
    let advice = advise::warnings(rig, &scene);
    let (revision, tick) = rig.apply(scene).await?;
    Ok(ChangeReply {
        revision,
        tick: Some(tick),
        ramp_ends_tick: None,
        dry_run: false,
        changes: Vec::new(),
        applied: changes.iter().map(|(key, value)| (key.to_string(), *value)).collect(),
        advice,
    })
}
