//! `get`: reads the active scene, or another.

use crate::control::{RigHandle, library};
use haptic_core::Scene;
use haptic_ipc::{SceneRef, SceneReply, WireError, params_of};

pub(super) async fn get(rig: &RigHandle, which: Option<SceneRef>) -> Result<SceneReply, WireError> {
    let scene = match which {
        Some(which) => library::find(rig, which).await?,
        None => Scene::clone(&rig.scene()),
    };
    Ok(SceneReply {
        revision: rig.revision(),
        params: params_of(&scene),
        scene,
    })
}
