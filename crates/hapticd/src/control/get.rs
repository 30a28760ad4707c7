//! `get`: the scene in force.

use crate::control::RigHandle;
use haptic_ipc::{SceneReply, params_of};

pub(super) fn get(rig: &RigHandle) -> SceneReply {
    let scene = rig.scene();
    SceneReply {
        revision: rig.revision(),
        params: params_of(&scene),
        scene,
    }
}
