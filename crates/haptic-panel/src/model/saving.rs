//! The daemon's answer to saving a scene.

use crate::notice::Notice;
use haptic_ipc::{ErrorCode, SceneSaveReply, WireError};

/// It is in the library.
pub(super) fn saved(reply: &SceneSaveReply) -> Notice {
    Notice::new(Ok(format!("Saved as {} ({})", reply.name, reply.path)))
}

/// It is not; `would_replace` becomes its name where a scene of that name is there.
pub(super) fn refused(name: &str, error: WireError, would_replace: &mut Option<String>) -> Notice {
    let why = if error.code == ErrorCode::SceneExists {
        *would_replace = Some(name.to_owned());
        format!("The library has a scene {name} already: save under another name, or replace it")
    } else {
        error.message
    };
    Notice::new(Err(why))
}
