//! The scene of a command that works without a daemon. One that only the daemon has is asked for.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_core::Scene;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::scene::SceneFile;
use haptic_ipc::{BUILT_IN_SCENES, ClientError, Request, SceneRef, SceneReply};
use std::path::Path;

/// Finds a scene: built in, from a file, or of the daemon.
pub(crate) async fn find(socket: Option<&Path>, text: &str) -> Result<Scene, Failure> {
    let scene = match reference::read(text)? {
        SceneRef::Scene(scene) => return Ok(scene.on(None)),
        scene => scene,
    };
    if let SceneRef::Name(name) = &scene {
        if Path::new(name).is_file() && !output::is_quiet() {
            eprintln!("haptic-ctl: `{name}` is the scene of the library here; for the file write ./{name}");
        }
        if let Some(built_in) = built_in(name) {
            let file = toml::from_str::<SceneFile>(built_in);
            let file = file.map_err(|error| Failure::Usage(format!("{name}: {error}")))?;
            return Ok(file.on(None));
        }
    }
    let mut daemon = match Daemon::connect(socket).await {
        Ok(daemon) => daemon,
        Err(Failure::Client(ClientError::NoDaemon { .. })) => return Err(without_a_daemon(text)),
        Err(failure) => return Err(failure),
    };
    let reply: SceneReply = reference::ask(&mut daemon, Request::Get { scene: Some(scene) }).await?;
    Ok(reply.scene)
}

fn built_in(name: &str) -> Option<&'static str> {
    let (_, text) = BUILT_IN_SCENES.iter().find(|(known, _)| *known == name)?;
    Some(text)
}

fn without_a_daemon(text: &str) -> Failure {
    let known: Vec<&str> = BUILT_IN_SCENES.iter().map(|(name, _)| *name).collect();
    Failure::Usage(format!(
        "`{text}` is not built in, and no daemon is there to ask for it{} the built-in scenes are {}",
        meant_or_semicolon(text, &known),
        known.join(", ")
    ))
}
