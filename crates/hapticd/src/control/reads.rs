//! Operations that only read: `describe`, `get`, `scene.diff`, `log` and `timing`.

use crate::control::{RigHandle, library};
use haptic_core::Scene;
use haptic_ipc::{
    Description, LogReply, SceneDiffReply, SceneRef, SceneReply, Timing, WireError, differences, params_of,
};

pub(super) fn describe(rig: &RigHandle) -> Description {
    Description::of(&rig.scene())
}

pub(super) fn timing(rig: &RigHandle) -> Timing {
    rig.feed().timing_report()
}

/// Default number of entries in an answer: a line with more is hard to read.
const DEFAULT_LIMIT: usize = 100;

pub(super) fn log(rig: &RigHandle, after: Option<u64>, limit: Option<usize>) -> LogReply {
    rig.journal(after.unwrap_or(0), limit.unwrap_or(DEFAULT_LIMIT))
}

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
