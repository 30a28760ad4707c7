//! `scene`: whole scenes, from the library, from an earlier revision, or from a file.

mod delete;
mod diff;
mod list;
mod load;
pub(crate) mod offline;
pub(crate) mod reference;
mod rename;
mod save;
mod show;

use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::Request;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// List the scenes of the library: built in, and saved
    List,
    /// Load a scene
    Load(load::Arguments),
    /// Save a scene in the library
    Save(save::Arguments),
    /// Rename a saved scene
    Rename(rename::Arguments),
    /// Delete a saved scene
    Delete(delete::Arguments),
    /// Show the differences of two scenes
    Diff(diff::Arguments),
    /// Print a scene as TOML, as `scene load` takes it
    Show(show::Arguments),
}

impl Command {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        match self {
            Self::List => Ok(Request::SceneList {}),
            Self::Load(load) => load.request(),
            Self::Save(save) => save.request(),
            Self::Rename(rename) => Ok(rename.request()),
            Self::Delete(delete) => Ok(delete.request()),
            Self::Diff(diff) => diff.request(),
            Self::Show(show) => show.request(),
        }
    }

    pub(crate) async fn run(&self, daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
        match self {
            Self::List => list::run(daemon, request, json).await,
            Self::Load(_) => load::run(daemon, request, json).await,
            Self::Save(_) => save::run(daemon, request, json).await,
            Self::Rename(_) => rename::run(daemon, request, json).await,
            Self::Delete(_) => delete::run(daemon, request, json).await,
            Self::Diff(_) => diff::run(daemon, request, json).await,
            Self::Show(_) => show::run(daemon, request, json).await,
        }
    }
}
