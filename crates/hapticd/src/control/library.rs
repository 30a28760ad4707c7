//! The library of scenes: the built-in ones, and the saved ones, a TOML file each.

use crate::config::MAX_TITLE;
use crate::control::history::Origin;
use crate::control::{RigHandle, whole_file};
use crate::threads::{WorkError, Workers};
use haptic_core::Scene;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::scene::SceneFile;
use haptic_ipc::regular_file::with_short_lines;
use haptic_ipc::{
    BUILT_IN_SCENES, ErrorCode, ListedScene, Peer, SceneDiffReply, SceneListReply, SceneRef, SceneReply,
    SceneSaveReply, WireError, differences, params_of, regular_file,
};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// Longest name of a saved scene, bytes.
const MAX_NAME: usize = 64;

/// Most saved scenes. With the two lengths below this bounds the answer to `scene.list`, which is
/// held in memory until the client has read it.
const MAX_SAVED: usize = 500;

/// Longest message about a scene that cannot be loaded, bytes: the TOML parser quotes the line,
/// which may have any length.
const MAX_PROBLEM: usize = 400;

/// Timeout of the disk. Only the client that asked waits for it; a stop does not.
const DISK_TIMEOUT: Duration = Duration::from_secs(2);

/// Threads at a time that read and write it.
const MAX_WORKERS: usize = 4;

/// The saved scenes.
#[derive(Debug)]
pub(super) struct Library {
    directory: PathBuf,
    workers: Workers,
}

impl Library {
    /// The scenes saved in a directory.
    pub(super) fn new(directory: PathBuf) -> Self {
        Self {
            directory,
            workers: Workers::new("library", MAX_WORKERS),
        }
    }

    /// Runs work on the disk, which may be slow or never answer: neither a stop nor the end of the daemon may wait for
    /// it.
    ///
    /// # Errors
    /// The disk does not answer in time.
    pub(super) async fn on_disk<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, WorkError> {
        self.workers.run(DISK_TIMEOUT, work).await
    }

    /// The same with the file of a scene, which an error names.
    async fn on_file<T: Send + 'static>(
        &self,
        path: PathBuf,
        work: impl FnOnce(&Path) -> Result<T, WireError> + Send + 'static,
    ) -> Result<T, WireError> {
        let shown = path.display().to_string();
        self.on_disk(move || work(&path)).await.unwrap_or_else(|error| {
            let hint = match error {
                WorkError::TimedOut { .. } => "; a file being saved may still be written",
                WorkError::Failed(_) => "",
            };
            let message = format!("{shown}: {error}{hint}");
            Err(WireError::new(ErrorCode::SceneFile, message).about("scene"))
        })
    }

    fn path_of(&self, name: &str) -> Result<PathBuf, WireError> {
        check(name)?;
        Ok(self.directory.join(format!("{name}.toml")))
    }

    /// The path of a scene that may be written; `what` cannot be done to a built-in one.
    fn path_of_saved(&self, name: &str, what: &str) -> Result<PathBuf, WireError> {
        if BUILT_IN_SCENES.iter().any(|(known, _)| *known == name) {
            let message = format!("the scene `{name}` is built in and cannot be {what}: choose another name");
            return Err(WireError::new(ErrorCode::SceneExists, message).about("name"));
        }
        self.path_of(name)
    }

    /// Lists all scenes of the library.
    ///
    /// # Errors
    /// Its directory exists and cannot be read.
    pub(super) async fn list(&self) -> Result<SceneListReply, WireError> {
        self.on_file(self.directory.clone(), |directory| {
            let mut scenes: Vec<ListedScene> = BUILT_IN_SCENES
                .iter()
                .map(|(name, text)| listed(name, None, read(name, text)))
                .collect();
            let built_in = scenes.len();
            for (name, path) in saved(directory).map_err(|error| file_error(directory, &error))? {
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
}

/// Finds the scene that a reference names, as the connected rig holds it.
///
/// # Errors
/// The name or revision is unknown, or the file cannot be read.
pub(super) async fn find(rig: &RigHandle, scene: SceneRef) -> Result<Scene, WireError> {
    find_file(rig, scene).await.map(|file| file.on(rig.known.coupling()))
}

async fn find_file(rig: &RigHandle, scene: SceneRef) -> Result<SceneFile, WireError> {
    match scene {
        SceneRef::Scene(scene) => {
            sound(&scene)?;
            Ok(*scene)
        }
        SceneRef::Revision(revision) => rig
            .history()
            .scene(revision)
            .map(|scene| Scene::clone(scene).into())
            .ok_or_else(|| {
                let message = format!(
                    "revision {revision} is unknown: the history holds revisions {} to {}",
                    rig.history().oldest(),
                    rig.revision()
                );
                WireError::new(ErrorCode::NoSuchScene, message).about("scene")
            }),
        SceneRef::Name(name) => {
            if let Some((_, text)) = BUILT_IN_SCENES.iter().find(|(known, _)| *known == name) {
                return read(&name, text);
            }
            let path = rig.library.path_of(&name)?;
            let read_it = move |path: &Path| match regular_file::read_text(path) {
                Ok(text) => read(&path.display().to_string(), &text),
                Err(error) => Err(missing_or(path, &name, &error)),
            };
            rig.library.on_file(path, read_it).await
        }
    }
}

/// `get`: a scene, by default the newest one.
///
/// # Errors
/// As [`find`].
pub(super) async fn get(rig: &RigHandle, which: Option<SceneRef>) -> Result<SceneReply, WireError> {
    let scene = find_or_newest(rig, which).await?;
    Ok(SceneReply {
        revision: rig.revision(),
        params: params_of(&scene),
        scene,
    })
}

/// `scene.diff`: how two scenes differ, the second by default the newest one.
///
/// # Errors
/// As [`find`].
pub(super) async fn diff(rig: &RigHandle, from: SceneRef, to: Option<SceneRef>) -> Result<SceneDiffReply, WireError> {
    let from = find(rig, from).await?;
    let to = find_or_newest(rig, to).await?;
    Ok(SceneDiffReply {
        differences: differences(&from, &to),
    })
}

async fn find_or_newest(rig: &RigHandle, scene: Option<SceneRef>) -> Result<Scene, WireError> {
    match scene {
        Some(scene) => find(rig, scene).await,
        None => Ok(Scene::clone(&rig.scene())),
    }
}

/// Finds the file of a scene, and the scene of the library that it is on the connected rig, if it is named.
///
/// # Errors
/// As [`find`].
pub(super) async fn find_with_origin(
    rig: &RigHandle,
    scene: SceneRef,
) -> Result<(SceneFile, Option<Rc<Origin>>), WireError> {
    let name = match &scene {
        SceneRef::Name(name) => Some(name.clone()),
        SceneRef::Revision(_) | SceneRef::Scene(_) => None,
    };
    let file = find_file(rig, scene).await?;
    let origin = name.map(|name| {
        let scene = file.clone().on(rig.known.coupling());
        Rc::new(Origin { name, scene })
    });
    Ok((file, origin))
}

/// The names and files of the saved scenes.
fn saved(directory: &Path) -> std::io::Result<Vec<(String, PathBuf)>> {
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let scenes = paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let named = scenes.filter_map(|path| Some((path.file_stem()?.to_str()?.to_owned(), path)));
    Ok(named.filter(|(name, _)| check(name).is_ok()).take(MAX_SAVED).collect())
}

fn listed(name: &str, path: Option<&Path>, scene: Result<SceneFile, WireError>) -> ListedScene {
    let (title, law, problem) = match scene {
        Ok(scene) => (scene.name, scene.friction.law().to_owned(), None),
        Err(error) => (String::new(), String::new(), Some(cut(error.message, MAX_PROBLEM))),
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

/// Most files that are named because they hold no scene.
const MAX_PROBLEMS: usize = 20;

/// Looks through the files of the library. The active scene stays as it is, and is no longer known as the one of the
/// library where that has changed. Returns the scene that the active one comes from, where its file has changed since;
/// and why files hold no scene.
pub(super) async fn look_through(rig: &RigHandle) -> (Option<String>, Vec<String>) {
    let listed = match rig.library.list().await {
        Ok(listed) => listed,
        Err(error) => return (None, vec![error.message]),
    };
    let problems = listed.scenes.into_iter().filter_map(|scene| scene.problem);
    let problems = problems.take(MAX_PROBLEMS).collect();
    let origin = rig.history().origin().cloned();
    let Some(origin) = origin else { return (None, problems) };
    let changed_scene = match find(rig, SceneRef::Name(origin.name.clone())).await {
        Ok(scene) if scene != origin.scene => {
            rig.history_mut().saved(&origin.name, &scene);
            Some(origin.name.clone())
        }
        // The same; or deleted, or among the problems.
        _ => None,
    };
    (changed_scene, problems)
}

/// Saves a scene. Its file is written whole or not at all.
///
/// # Errors
/// The name is invalid or taken, or the file cannot be written.
pub(super) async fn save(
    rig: &RigHandle,
    by: &Peer,
    name: String,
    scene: Option<SceneRef>,
    replace: bool,
) -> Result<SceneSaveReply, WireError> {
    let path = rig.library.path_of_saved(&name, "replaced")?;
    let is_active = scene.is_none();
    let mut scene = match scene {
        Some(scene) => find_file(rig, scene).await?,
        None => Scene::clone(&rig.scene()).into(),
    };
    if is_active {
        scene.name = rig.history().title_to_save(&name);
    }
    let kept = scene.clone().on(rig.known.coupling());
    let text = toml::to_string(&scene).map_err(|error| WireError::new(ErrorCode::SceneFile, error.to_string()))?;
    let write = move |path: &Path| {
        let directory = path.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(directory).map_err(|error| file_error(directory, &error))?;
        let others = saved(directory).map_err(|error| file_error(directory, &error))?;
        if others.len() >= MAX_SAVED && !others.iter().any(|(other, _)| *other == name) {
            let message = format!(
                "{}: the library is full with {MAX_SAVED} scenes: remove the file of one, or replace one",
                directory.display()
            );
            return Err(WireError::new(ErrorCode::SceneFile, message).about("name"));
        }
        match whole_file::write(path, &text, replace) {
            Ok(()) => Ok(kept_in(path, name)),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => Err(taken(&name)),
            Err(error) => Err(file_error(path, &error)),
        }
    };
    let saved = rig.library.on_file(path, write).await?;
    rig.history_mut().saved(&saved.name, &kept);
    rig.enter_done("scene.save", Some(by), Some(saved.path.clone()));
    Ok(saved)
}

/// Deletes a saved scene.
///
/// # Errors
/// The name is invalid, unknown or that of a built-in scene, or the file cannot be removed.
pub(super) async fn delete(rig: &RigHandle, by: &Peer, name: String) -> Result<SceneSaveReply, WireError> {
    let path = rig.library.path_of_saved(&name, "deleted")?;
    let remove = move |path: &Path| match std::fs::remove_file(path) {
        Ok(()) => Ok(kept_in(path, name)),
        Err(error) => Err(missing_or(path, &name, &error)),
    };
    let deleted = rig.library.on_file(path, remove).await?;
    rig.history_mut().forget_origin(&deleted.name);
    rig.enter_done("scene.delete", Some(by), Some(deleted.path.clone()));
    Ok(deleted)
}

/// Renames a saved scene.
///
/// # Errors
/// A name is invalid or that of a built-in scene, the old one is unknown or the new one taken, or the
/// file cannot be renamed.
pub(super) async fn rename(
    rig: &RigHandle,
    by: &Peer,
    name: String,
    to: String,
    replace: bool,
) -> Result<SceneSaveReply, WireError> {
    let from = rig.library.path_of_saved(&name, "renamed")?;
    let path = rig.library.path_of_saved(&to, "replaced")?;
    let old = name.clone();
    let rename = move |from: &Path| {
        let flags = if replace {
            RenameFlags::empty()
        } else {
            RenameFlags::NOREPLACE
        };
        match renameat_with(CWD, from, CWD, &path, flags) {
            Ok(()) => Ok(kept_in(&path, to)),
            Err(Errno::EXIST) => Err(taken(&to)),
            Err(error) => Err(missing_or(from, &old, &error.into())),
        }
    };
    let renamed = rig.library.on_file(from, rename).await?;
    rig.history_mut().renamed(&name, &renamed.name);
    rig.enter_done("scene.rename", Some(by), Some(renamed.path.clone()));
    Ok(renamed)
}

/// Checks the name of a saved scene, which is also the name of its file.
fn check(name: &str) -> Result<(), WireError> {
    let fits = |letter: char| letter.is_ascii_alphanumeric() || "-_. ".contains(letter);
    let sound = name.starts_with(|first: char| first.is_ascii_alphanumeric()) && name.chars().all(fits);
    if sound && name.len() <= MAX_NAME && name.trim_end() == name {
        return Ok(());
    }
    let message = format!(
        "`{name}` is not a valid name of a scene: it must begin with a letter or digit, and have at most \
         {MAX_NAME} letters, digits, `-`, `_`, `.` and spaces"
    );
    Err(WireError::new(ErrorCode::BadName, message).about("name"))
}

fn read(whence: &str, text: &str) -> Result<SceneFile, WireError> {
    let scene: SceneFile = toml::from_str(text).map_err(|error| {
        let message = cut(
            format!("{whence}: {}", with_short_lines(&error.to_string())),
            MAX_PROBLEM + whence.len(),
        );
        WireError::new(ErrorCode::SceneFile, message).about("scene")
    })?;
    sound(&scene).map_err(|error| WireError {
        message: format!("{whence}: {}", error.message),
        ..error
    })?;
    Ok(scene)
}

/// Checks that a scene can be rendered, and that its title is short enough to be kept many times.
fn sound(scene: &SceneFile) -> Result<(), WireError> {
    scene.validate()?;
    let bytes = scene.name.len();
    if bytes <= MAX_TITLE {
        return Ok(());
    }
    #[expect(clippy::cast_precision_loss, reason = "at most a megabyte")]
    let (value, most) = (bytes as f64, MAX_TITLE as f64);
    let message =
        format!("name = {bytes} bytes is out of range: the name of a scene must have at most {MAX_TITLE} bytes");
    Err(WireError::new(ErrorCode::OutOfRange, message)
        .about("name")
        .within(value, 0.0, most, "bytes"))
}

/// The answer about a scene that is, or was, in a file.
fn kept_in(path: &Path, name: String) -> SceneSaveReply {
    let path = path.display().to_string();
    SceneSaveReply { name, path }
}

fn taken(name: &str) -> WireError {
    let message = format!("the library already has a scene `{name}`: set `replace` to overwrite it");
    WireError::new(ErrorCode::SceneExists, message).about("name")
}

/// Why the file of a scene cannot be used: the library does not have it, or the system's reason.
fn missing_or(path: &Path, name: &str, error: &std::io::Error) -> WireError {
    if error.kind() != std::io::ErrorKind::NotFound {
        return file_error(path, error);
    }
    // The names are only for the guess: a directory that cannot be read has none.
    let saved = path
        .parent()
        .and_then(|directory| saved(directory).ok())
        .unwrap_or_default();
    let saved = saved.iter().map(|(name, _)| name.as_str());
    let known: Vec<&str> = BUILT_IN_SCENES.iter().map(|(known, _)| *known).chain(saved).collect();
    let message = format!(
        "there is no scene `{name}` in the library{} `scene.list` lists all",
        meant_or_semicolon(name, &known)
    );
    WireError::new(ErrorCode::NoSuchScene, message).about("scene")
}

fn file_error(path: &Path, error: &std::io::Error) -> WireError {
    WireError::new(ErrorCode::SceneFile, format!("{}: {error}", path.display())).about("scene")
}
