//! `get`: reads the active scene, or another.

use crate::control::{RigHandle, library};
use haptic_ipc::{SceneRef, SceneReply, WireError, params_of};

pub(super) async fn get(rig: &RigHandle, which: Option<SceneRef>) -> Result<SceneReply, WireError> {
    let scene = match which {
        Some(which) => library::find(rig, which).await?,
        None => rig.scene().clone(),
    };
    Ok(SceneReply {
        revision: rig.revision(),
        params: params_of(&scene),
        scene,
    })
}
