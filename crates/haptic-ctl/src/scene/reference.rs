//! Which scene is meant: `viscous-drag` of the library, revision `@42` or `42`, or the file
//! `mine.toml`.

use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_core::scene::SceneFile;
use haptic_ipc::regular_file::{self, with_short_lines};
use haptic_ipc::{ClientError, ErrorCode, Request, SceneListReply, SceneRef};
use serde::de::DeserializeOwned;
use std::path::Path;

pub(crate) const HELP: &str = "Scene: NAME, @REVISION or FILE.toml";

/// Reads which scene is meant; a file is read here, and sent whole.
pub(crate) fn read(text: &str) -> Result<SceneRef, Failure> {
    let number = text.strip_prefix('@').unwrap_or(text);
    if let Ok(revision) = number.parse() {
        return Ok(SceneRef::Revision(revision));
    }
    if number.len() < text.len() {
        return Err(Failure::Usage(format!("`{text}` is not a revision: write @42")));
    }
    if let Some(path) = path(text) {
        return file(path).map(|scene| SceneRef::Scene(Box::new(scene)));
    }
    Ok(SceneRef::Name(text.to_owned()))
}

/// The file that is meant: a text with a slash, or that ends in `.toml`.
pub(crate) fn path(text: &str) -> Option<&Path> {
    let path = Path::new(text);
    let is_file = text.contains('/') || path.extension().is_some_and(|extension| extension == "toml");
    is_file.then_some(path)
}

/// Reads the scene that may be left out.
pub(crate) fn read_optional(text: Option<&String>) -> Result<Option<SceneRef>, Failure> {
    text.map(|text| read(text)).transpose()
}

/// Reads a scene's file. A scene without a name gets the file's.
fn file(path: &Path) -> Result<SceneFile, Failure> {
    let refused = |error: &dyn std::fmt::Display| Failure::Usage(format!("{}: {error}", path.display()));
    let text = regular_file::read_text(path).map_err(|error| refused(&error))?;
    let mut scene: SceneFile = toml::from_str(&text).map_err(|error| refused(&with_short_lines(&error.to_string())))?;
    if scene.name.is_empty() {
        scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    scene.validate().map_err(|error| refused(&error))?;
    Ok(scene)
}

/// Sends a request about scenes. Where no scene has the name, nor one like it, the error lists the
/// library.
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
    if !error.message.contains("did you mean") {
        let listed: SceneListReply = daemon.ask(Request::SceneList {}).await?;
        let known: Vec<&str> = listed.scenes.iter().map(|scene| scene.name.as_str()).collect();
        error.message.push_str(&format!("; there are {}", known.join(", ")));
    }
    Err(ClientError::Refused(error).into())
}

fn names_in(request: &Request) -> Vec<&String> {
    let scenes: Vec<&SceneRef> = match request {
        Request::SceneDelete { name } | Request::SceneRename { name, .. } => return vec![name],
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
    fn misspelt_word_in_a_file_lists_the_known_ones() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("mine.toml");
        for (text, known) in [
            ("[friction]\nlaw = \"viscous\"\nvisous = 1\n", "`viscous`"),
            ("[friction]\nlaw = \"viscos\"\nviscous = 1\n", "`viscous`"),
            ("[frictoin]\nlaw = \"viscous\"\nviscous = 1\n", "`friction`"),
        ] {
            std::fs::write(&path, text).expect("it can be written");
            let error = file(&path).expect_err(text).to_string();
            assert!(error.contains(known), "{text}: {error}");
        }
    }
}
