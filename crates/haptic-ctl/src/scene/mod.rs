//! `scene`: whole scenes, from the library, from an earlier revision, or from a file.

pub(crate) mod offline;
pub(crate) mod reference;

use crate::change::{self, ChangeArguments};
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output};
use clap::{Args, Subcommand};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, SceneDiffReply, SceneListReply, SceneReply, SceneSaveReply};
use std::fs::File;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// List the scenes of the library: built in, and saved
    List,
    /// Load a scene
    #[command(after_help = "Example:\n  haptic-ctl scene load viscous-drag --ramp 1s")]
    Load {
        #[arg(help = reference::HELP, add = ArgValueCompleter::new(complete::scenes))]
        scene: String,

        #[command(flatten)]
        change: ChangeArguments,
    },
    /// Save a scene in the library
    Save(Save),
    /// Rename a saved scene
    Rename(Rename),
    /// Delete a saved scene
    Delete {
        /// Name of a saved scene in the library
        #[arg(add = ArgValueCompleter::new(complete::scenes))]
        name: String,
    },
    /// Show the differences of two scenes
    #[command(after_help = "Examples:\n  haptic-ctl scene diff lugre\n  haptic-ctl scene diff @3 @5")]
    Diff {
        #[arg(help = reference::HELP, add = ArgValueCompleter::new(complete::scenes))]
        from: String,

        /// The other, likewise [default: active]
        #[arg(add = ArgValueCompleter::new(complete::scenes))]
        to: Option<String>,
    },
    /// Print a scene as TOML, as `scene load` takes it
    Show {
        /// Scene: NAME, @REVISION or FILE.toml [default: active]
        #[arg(add = ArgValueCompleter::new(complete::scenes))]
        scene: Option<String>,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Save {
    /// Name in the library
    name: String,

    /// Scene: NAME, @REVISION or FILE.toml [default: active]
    #[arg(long, add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,

    /// Replace a saved scene of this name
    #[arg(long)]
    replace: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Rename {
    /// Name of a saved scene in the library
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    name: String,

    /// Its new name
    to: String,

    /// Replace a saved scene of the new name
    #[arg(long)]
    replace: bool,
}

impl Command {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        Ok(match self {
            Self::List => Request::SceneList {},
            Self::Load { scene, change } => Request::SceneLoad {
                scene: reference::read(scene)?,
                options: change.options(),
            },
            Self::Save(save) => Request::SceneSave {
                name: save.name.clone(),
                scene: reference::read_optional(save.scene.as_ref())?,
                replace: save.replace,
            },
            Self::Rename(rename) => Request::SceneRename {
                name: rename.name.clone(),
                to: rename.to.clone(),
                replace: rename.replace,
            },
            Self::Delete { name } => Request::SceneDelete { name: name.clone() },
            Self::Diff { from, to } => Request::SceneDiff {
                from: reference::read(from)?,
                to: reference::read_optional(to.as_ref())?,
            },
            Self::Show { scene } => Request::Get {
                scene: reference::read_optional(scene.as_ref())?,
            },
        })
    }

    pub(crate) async fn run(&self, daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
        match self {
            Self::List => list(daemon, request, json).await,
            Self::Load { change, .. } => change::run(daemon, request, change.wait, json).await,
            Self::Save(_) => saved(daemon, request, json, |reply| place(&reply)).await,
            Self::Rename(rename) => {
                saved(daemon, request, json, |reply| {
                    format!("{} is renamed: {}", rename.name, place(&reply))
                })
                .await
            }
            Self::Delete { .. } => saved(daemon, request, json, |reply| format!("{} is deleted", reply.name)).await,
            Self::Diff { .. } => diff(daemon, request, json).await,
            Self::Show { .. } => show(daemon, request, json).await,
        }
    }
}

async fn list(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneListReply = daemon.ask(request).await?;
    if json {
        return output::json(&reply);
    }
    let mut rows = vec![output::row(["name", "law", "title", "file"])];
    rows.extend(reply.scenes.iter().map(|scene| {
        vec![
            scene.name.clone(),
            scene.law.clone(),
            scene
                .problem
                .as_ref()
                .map_or_else(|| scene.title.clone(), |_| "cannot be loaded".to_owned()),
            scene.path.clone().unwrap_or_else(|| "built in".to_owned()),
        ]
    }));
    output::line(&output::table(&rows))?;
    // Below the table, which no broken file makes wider.
    for scene in &reply.scenes {
        if let Some(problem) = &scene.problem {
            output::line(&format!("\n{} cannot be loaded: {problem}", scene.name))?;
        }
    }
    Ok(())
}

/// Asks for a change of the library, and says what it has done.
async fn saved(
    daemon: &mut Daemon,
    request: Request,
    json: bool,
    text: impl FnOnce(SceneSaveReply) -> String,
) -> Result<(), Failure> {
    let reply: SceneSaveReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply);
    }
    output::unless_quiet(&text(reply))
}

/// Where a saved scene is. The files of a service are its own: who cannot open them gets the command that shows it.
fn place(SceneSaveReply { name, path }: &SceneSaveReply) -> String {
    match File::open(path) {
        Ok(_) => format!("{name} is in {path}"),
        Err(_) => format!("{name} is saved: `haptic-ctl scene show '{name}'` prints it"),
    }
}

async fn diff(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneDiffReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply);
    }
    if reply.differences.is_empty() {
        return output::line("nothing differs");
    }
    for difference in &reply.differences {
        output::line(&difference.to_string())?;
    }
    Ok(())
}

async fn show(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply.scene);
    }
    let text = toml::to_string(&reply.scene).map_err(std::io::Error::other)?;
    output::exact(text.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_opened_is_not_named() {
        let place = |path: &str| {
            place(&SceneSaveReply {
                name: "mine".to_owned(),
                path: path.to_owned(),
            })
        };
        let file = tempfile::NamedTempFile::new().expect("a file");
        let path = file.path().display().to_string();
        assert_eq!(place(&path), format!("mine is in {path}"));
        assert_eq!(
            place("/nonexistent/mine.toml"),
            "mine is saved: `haptic-ctl scene show 'mine'` prints it"
        );
    }
}
