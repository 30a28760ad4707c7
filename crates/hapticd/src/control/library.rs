//! The library of scenes: those that come with the daemon, and those that were saved, one TOML file
//! each.

use crate::control::RigHandle;
use crate::control::aside::{Aside, AsideError};
use crate::control::history::LONGEST_TITLE;
use crate::control::journal::Completion;
use crate::control::whole_file;
use haptic_core::Scene;
use haptic_ipc::{
    ErrorCode, JournalEntry, ListedScene, Peer, SceneListReply, SceneRef, SceneSaveReply, WireError,
    meant_or_semicolon, regular_file,
};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The scenes that come with the daemon, by name.
const BUILT_IN: &[(&str, &str)] = &[
    (
        "simulated-friction",
        include_str!("../../../../scenes/simulated-friction.toml"),
    ),
    ("no-friction", include_str!("../../../../scenes/no-friction.toml")),
    ("high-stiction", include_str!("../../../../scenes/high-stiction.toml")),
    ("viscous-drag", include_str!("../../../../scenes/viscous-drag.toml")),
    (
        "aluminium-on-teflon",
        include_str!("../../../../scenes/aluminium-on-teflon.toml"),
    ),
    (
        "stuck-spring-on-the-device",
        include_str!("../../../../scenes/stuck-spring-on-the-device.toml"),
    ),
    (
        "asymmetric-with-memory",
        include_str!("../../../../scenes/asymmetric-with-memory.toml"),
    ),
    ("lugre", include_str!("../../../../scenes/lugre.toml")),
];

/// Longest name.
const LONGEST_NAME: usize = 64;

/// Scenes that are kept. With the two lengths below this bounds the answer to `scene.list`, which
/// is held for a client until it has read it.
const MOST_SAVED: usize = 500;

/// What is told of why a scene cannot be loaded, bytes: the reader of TOML shows the line, which
/// may be of any length.
const LONGEST_PROBLEM: usize = 400;

/// How long the disk may take. Nothing that stops waits for it, but the client that asked does.
const DISK_TIMEOUT: Duration = Duration::from_secs(2);

/// The scene that is meant.
///
/// # Errors
/// There is none of this name or revision, or its file cannot be read.
pub(super) async fn find(rig: &RigHandle, scene: SceneRef) -> Result<Scene, WireError> {
    match scene {
        SceneRef::Scene(scene) => {
            sound(&scene)?;
            Ok(*scene)
        }
        SceneRef::Revision(revision) => rig.history().scene(revision).cloned().ok_or_else(|| {
            let message = format!(
                "there is no revision {revision}: those from {} to {} are known",
                rig.history().oldest(),
                rig.revision()
            );
            WireError::new(ErrorCode::NoSuchScene, message).about("scene")
        }),
        SceneRef::Name(name) => {
            if let Some((_, text)) = BUILT_IN.iter().find(|(known, _)| *known == name) {
                return read(&name, text);
            }
            let path = path_of(rig, &name)?;
            let shown = path.clone();
            on_a_thread(rig.library(), &shown, move || match regular_file::read_text(&path) {
                Ok(text) => read(&path.display().to_string(), &text),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                    // One that is only guessed at may be missing.
                    let saved = path
                        .parent()
                        .and_then(|directory| saved(directory).ok())
                        .unwrap_or_default();
                    let saved = saved.iter().map(|(name, _)| name.as_str());
                    let known: Vec<&str> = BUILT_IN.iter().map(|(known, _)| *known).chain(saved).collect();
                    let message = format!(
                        "there is no scene `{name}` in the library{} `scene.list` names those that there are",
                        meant_or_semicolon(&name, &known)
                    );
                    Err(WireError::new(ErrorCode::NoSuchScene, message).about("scene"))
                }
                Err(error) => Err(file_error(&path, &error)),
            })
            .await
        }
    }
}

/// All scenes of the library.
///
/// # Errors
/// Its directory is there and cannot be read.
pub(super) async fn list(rig: &RigHandle) -> Result<SceneListReply, WireError> {
    let directory = rig.facts.scene_dir.clone();
    on_a_thread(rig.library(), &rig.facts.scene_dir, move || {
        let mut scenes: Vec<ListedScene> = BUILT_IN
            .iter()
            .map(|(name, text)| listed(name, None, read(name, text)))
            .collect();
        let built_in = scenes.len();
        for (name, path) in saved(&directory).map_err(|error| file_error(&directory, &error))? {
            let scene = regular_file::read_text(&path)
                .map_err(|error| file_error(&path, &error))
                .and_then(|text| read(&path.display().to_string(), &text));
            scenes.push(listed(&name, Some(&path), scene));
        }
        scenes[built_in..].sort_by(|one, other| one.name.cmp(&other.name));
        Ok(SceneListReply { scenes })
    })
    .await
}

/// The names and files of the scenes that were saved.
fn saved(directory: &Path) -> std::io::Result<Vec<(String, PathBuf)>> {
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let scenes = paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let named = scenes.filter_map(|path| Some((path.file_stem()?.to_str()?.to_owned(), path)));
    Ok(named.filter(|(name, _)| check(name).is_ok()).take(MOST_SAVED).collect())
}

fn listed(name: &str, path: Option<&Path>, scene: Result<Scene, WireError>) -> ListedScene {
    let (title, law, problem) = match scene {
        Ok(scene) => (scene.name, scene.friction.law().to_owned(), None),
        Err(error) => (String::new(), String::new(), Some(cut(error.message, LONGEST_PROBLEM))),
    };
    ListedScene {
        name: name.to_owned(),
        title,
        law,
        path: path.map(|path| path.display().to_string()),
        problem,
    }
}

fn cut(mut text: String, longest: usize) -> String {
    if text.len() > longest {
        text.truncate(text.floor_char_boundary(longest));
        text.push_str("...");
    }
    text
}

/// Keeps a scene. A file is there as a whole, or not at all.
///
/// # Errors
/// The name is none, or taken; or the file cannot be written.
pub(super) async fn save(
    rig: &RigHandle,
    by: &Peer,
    name: String,
    scene: Option<SceneRef>,
    replace: bool,
) -> Result<SceneSaveReply, WireError> {
    if BUILT_IN.iter().any(|(known, _)| *known == name) {
        let message = format!("the scene `{name}` comes with the daemon and stays as it is: choose another name");
        return Err(WireError::new(ErrorCode::SceneExists, message).about("name"));
    }
    let path = path_of(rig, &name)?;
    let scene = match scene {
        Some(scene) => find(rig, scene).await?,
        None => rig.scene().clone(),
    };
    let text = toml::to_string(&scene).map_err(|error| WireError::new(ErrorCode::SceneFile, error.to_string()))?;
    let shown = path.clone();
    let saved = on_a_thread(rig.library(), &shown, move || {
        let directory = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(directory).map_err(|error| file_error(directory, &error))?;
        let others = saved(directory).map_err(|error| file_error(directory, &error))?;
        if others.len() >= MOST_SAVED && !others.iter().any(|(other, _)| *other == name) {
            let message = format!(
                "{}: the library has {MOST_SAVED} scenes, the most that it may hold: remove the file of one, or replace one",
                directory.display()
            );
            return Err(WireError::new(ErrorCode::SceneFile, message).about("name"));
        }
        match whole_file::write(&path, &text, replace) {
            Ok(()) => Ok(SceneSaveReply {
                name,
                path: path.display().to_string(),
            }),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                let message = format!("the library has a scene `{name}` already: say `replace` to write over it");
                Err(WireError::new(ErrorCode::SceneExists, message).about("name"))
            }
            Err(error) => Err(file_error(&path, &error)),
        }
    })
    .await?;
    let entry = JournalEntry {
        by: Some(by.clone()),
        message: Some(saved.path.clone()),
        ..JournalEntry::of("scene.save")
    };
    rig.enter(Completion::Done, entry);
    Ok(saved)
}

fn path_of(rig: &RigHandle, name: &str) -> Result<PathBuf, WireError> {
    check(name)?;
    Ok(rig.facts.scene_dir.join(format!("{name}.toml")))
}

/// Whether a name can be one in the library, where it is the name of a file.
fn check(name: &str) -> Result<(), WireError> {
    let fits = |letter: char| letter.is_ascii_alphanumeric() || "-_. ".contains(letter);
    let sound = name.starts_with(|first: char| first.is_ascii_alphanumeric()) && name.chars().all(fits);
    if sound && name.len() <= LONGEST_NAME && name.trim_end() == name {
        return Ok(());
    }
    let message = format!(
        "`{name}` cannot be the name of a scene: it must begin with a letter or digit, have only those, `-`, `_`, `.` and spaces, and at most {LONGEST_NAME} of them"
    );
    Err(WireError::new(ErrorCode::BadName, message).about("name"))
}

fn read(whence: &str, text: &str) -> Result<Scene, WireError> {
    let scene: Scene = toml::from_str(text).map_err(|error| {
        let message = cut(format!("{whence}: {error}"), LONGEST_PROBLEM + whence.len());
        WireError::new(ErrorCode::SceneFile, message).about("scene")
    })?;
    sound(&scene)?;
    Ok(scene)
}

/// Whether a scene can be rendered, and kept many times.
fn sound(scene: &Scene) -> Result<(), WireError> {
    scene.validate()?;
    let bytes = scene.name.len();
    if bytes <= LONGEST_TITLE {
        return Ok(());
    }
    #[expect(clippy::cast_precision_loss, reason = "at most a megabyte")]
    let (value, most) = (bytes as f64, LONGEST_TITLE as f64);
    let message =
        format!("name = {bytes} bytes is out of range: the name of a scene must have at most {LONGEST_TITLE} bytes");
    Err(WireError::new(ErrorCode::OutOfRange, message)
        .about("name")
        .within(value, 0.0, most, "bytes"))
}

fn file_error(path: &Path, error: &std::io::Error) -> WireError {
    WireError::new(ErrorCode::SceneFile, format!("{}: {error}", path.display())).about("scene")
}

/// A disk may take its time, or never answer; a stop must not wait for it, nor the end of the
/// daemon.
async fn on_a_thread<T: Send + 'static>(
    library: &Aside,
    path: &Path,
    work: impl FnOnce() -> Result<T, WireError> + Send + 'static,
) -> Result<T, WireError> {
    library.run(DISK_TIMEOUT, work).await.unwrap_or_else(|error| {
        let hint = match error {
            AsideError::TimedOut { .. } => "; what was to be written may still be",
            AsideError::Failed(_) => "",
        };
        let message = format!("{}: {error}{hint}", path.display());
        Err(WireError::new(ErrorCode::SceneFile, message).about("scene"))
    })
}
