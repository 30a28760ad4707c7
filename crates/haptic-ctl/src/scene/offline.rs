//! The scene of a command that works without a daemon. One that only the daemon has is asked for.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use crate::stop;
use haptic_core::Scene;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::scene::SceneFile;
use haptic_ipc::{BUILT_IN_SCENES, ClientError, Request, SceneRef, SceneReply};
use std::path::Path;

/// Finds a scene: built in, from a file, or of the daemon.
pub(crate) async fn find(socket: Option<&Path>, text: &str) -> Result<Scene, Failure> {
    find_file(socket, text).await.map(|scene| scene.on(None))
}

/// Finds a scene as it is on the daemon's rig; without a daemon as [`find`] does.
pub(crate) async fn find_on_rig(socket: Option<&Path>, text: &str) -> Result<Scene, Failure> {
    let scene = Some(reference::read(text)?);
    let Some(mut daemon) = connected(socket).await? else {
        return find(socket, text).await;
    };
    let reply: SceneReply = reference::ask(&mut daemon, Request::Get { scene }).await?;
    Ok(reply.scene)
}

/// Finds a scene as it is written, whose coupling may be left to the rig. The daemon gives one on its own rig.
pub(crate) async fn find_file(socket: Option<&Path>, text: &str) -> Result<SceneFile, Failure> {
    let scene = match reference::read(text)? {
        SceneRef::Scene(scene) => return Ok(*scene),
        scene => scene,
    };
    if let SceneRef::Name(name) = &scene {
        if Path::new(name).is_file() && !output::is_quiet() {
            eprintln!("haptic-ctl: `{name}` is the scene of the library here; for the file write ./{name}");
        }
        if let Some(built_in) = built_in(name) {
            let file = toml::from_str::<SceneFile>(built_in);
            return file.map_err(|error| Failure::Usage(format!("{name}: {error}")));
        }
    }
    let mut daemon = connected(socket).await?.ok_or_else(|| without_a_daemon(text))?;
    let reply: SceneReply = reference::ask(&mut daemon, Request::Get { scene: Some(scene) }).await?;
    Ok(reply.scene.into())
}

/// The daemon, if there is one: where none is named, the only one in reach.
async fn connected(socket: Option<&Path>) -> Result<Option<Daemon>, Failure> {
    let socket = match socket {
        Some(socket) => Some(socket.to_owned()),
        None => stop::only_one()?,
    };
    match Daemon::connect(socket.as_deref()).await {
        Ok(daemon) => Ok(Some(daemon)),
        Err(Failure::Client(ClientError::NoDaemon { .. })) => Ok(None),
        Err(failure) => Err(failure),
    }
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
