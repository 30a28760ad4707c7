//! `scene.diff`: the differences of two scenes.

use crate::control::{RigHandle, library};
use haptic_core::Scene;
use haptic_ipc::{SceneDiffReply, SceneRef, WireError, differences};

pub(super) async fn diff(rig: &RigHandle, from: SceneRef, to: Option<SceneRef>) -> Result<SceneDiffReply, WireError> {
    let from = library::find(rig, from).await?;
    let to = match to {
        Some(to) => library::find(rig, to).await?,
        None => Scene::clone(&rig.scene()),
    };
    Ok(SceneDiffReply {
        differences: differences(&from, &to),
    })
}
