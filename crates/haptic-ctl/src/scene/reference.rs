//! Which scene is meant: `viscous-drag` of the library, revision `@42` or `42`, or the file `mine.toml`.

use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_core::Scene;
use haptic_ipc::{ClientError, ErrorCode, Request, SceneListReply, SceneRef};
use serde::de::DeserializeOwned;
use std::path::Path;

/// What the argument's help says everywhere.
pub(crate) const HELP: &str = "A name of the library, a revision as @42, or a FILE.toml";

/// Reads which scene is meant; a file is read here, and sent whole.
pub(crate) fn read(text: &str) -> Result<SceneRef, Failure> {
    let number = text.strip_prefix('@').unwrap_or(text);
    if let Ok(revision) = number.parse() {
        return Ok(SceneRef::Revision(revision));
    }
    if number.len() < text.len() {
        return Err(Failure::Usage(format!("`{text}` is no revision: write @42")));
    }
    if text.contains('/') || Path::new(text).extension().is_some_and(|extension| extension == "toml") {
        return file(Path::new(text)).map(|scene| SceneRef::Scene(Box::new(scene)));
    }
    Ok(SceneRef::Name(text.to_owned()))
}

/// Reads the scene that may be left out.
pub(crate) fn read_optional(text: Option<&String>) -> Result<Option<SceneRef>, Failure> {
    text.map(|text| read(text)).transpose()
}

/// Reads a scene's file. A scene without a name gets the file's.
pub(crate) fn file(path: &Path) -> Result<Scene, Failure> {
    let refused = |error: &dyn std::fmt::Display| Failure::Usage(format!("{}: {error}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| refused(&error))?;
    let mut scene: Scene = toml::from_str(&text).map_err(|error| refused(&error))?;
    if scene.name.is_empty() {
        scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    scene.validate().map_err(|error| refused(&error))?;
    Ok(scene)
}

/// Asks something about scenes. To a name that no scene has, the one that was probably meant is named.
pub(crate) async fn ask<R: DeserializeOwned>(daemon: &mut Daemon, request: Request) -> Result<R, Failure> {
    let names: Vec<String> = names_in(&request).into_iter().cloned().collect();
    let failure = match daemon.ask(request).await {
        Err(Failure::Client(ClientError::Refused(error)))
            if error.code == ErrorCode::NoSuchScene && !names.is_empty() =>
        {
            error
        }
        answered => return answered,
    };
    let mut error = failure;
    let listed: SceneListReply = daemon.ask(Request::SceneList {}).await?;
    let known: Vec<&str> = listed.scenes.iter().map(|scene| scene.name.as_str()).collect();
    let wrong = names.iter().find(|name| !known.contains(&name.as_str()));
    if let Some(meant) = wrong.and_then(|wrong| nearest(wrong, &known)) {
        error.message.push_str(&format!("; did you mean `{meant}`?"));
    } else {
        error.message.push_str(&format!("; there are {}", known.join(", ")));
    }
    Err(ClientError::Refused(error).into())
}

fn names_in(request: &Request) -> Vec<&String> {
    let scenes: Vec<&SceneRef> = match request {
        Request::SceneLoad { scene, .. } => vec![scene],
        Request::Get { scene } | Request::SceneSave { scene, .. } => scene.iter().collect(),
        Request::SceneDiff { from, to } => [Some(from), to.as_ref()].into_iter().flatten().collect(),
        _ => Vec::new(),
    };
    scenes
        .into_iter()
        .filter_map(|scene| match scene {
            SceneRef::Name(name) => Some(name),
            _ => None,
        })
        .collect()
}

/// The name that was most likely meant: one that begins so, or one of which at most a third of the letters differ.
fn nearest<'a>(wrong: &str, known: &[&'a str]) -> Option<&'a str> {
    let begun = known.iter().find(|name| wrong.len() > 2 && name.starts_with(wrong));
    begun.copied().or_else(|| {
        known
            .iter()
            .map(|name| (strsim::osa_distance(wrong, name), *name))
            .min()
            .filter(|(distance, name)| *distance <= name.len() / 3)
            .map(|(_, name)| name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_meant_by_name_revision_or_file() {
        let read = |text| read(text).map_err(|failure| failure.to_string());
        assert_eq!(read("@42"), Ok(SceneRef::Revision(42)));
        assert_eq!(read("42"), Ok(SceneRef::Revision(42)));
        assert_eq!(read("viscous-drag"), Ok(SceneRef::Name("viscous-drag".into())));
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/viscous-drag.toml");
        assert!(matches!(read(file), Ok(SceneRef::Scene(scene)) if scene.friction.law() == "viscous"));
        assert!(read("missing.toml").is_err_and(|error| error.contains("missing.toml")));
        assert!(read("@old").is_err_and(|error| error.contains("@42")));
    }

    #[test]
    fn the_nearest_name_is_one_that_could_have_been_meant() {
        let known = ["viscous-drag", "lugre", "no-friction"];
        assert_eq!(nearest("viscus-drag", &known), Some("viscous-drag"));
        assert_eq!(nearest("visc", &known), Some("viscous-drag"));
        assert_eq!(nearest("lurge", &known), Some("lugre"));
        assert_eq!(nearest("ice", &known), None);
    }
}
