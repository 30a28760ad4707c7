//! `scene save`: a scene is kept in the library.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, SceneSaveReply};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Name in the library
    name: String,

    /// Scene: a name of the library, a revision as @42, or a FILE.toml [default: active]
    #[arg(long, add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,

    /// Replace a saved scene of this name
    #[arg(long)]
    replace: bool,
}

impl Arguments {
    pub(super) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::SceneSave {
            name: self.name.clone(),
            scene: reference::read_optional(self.scene.as_ref())?,
            replace: self.replace,
        })
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneSaveReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply);
    }
    output::unless_quiet(&format!("{} is in {}", reply.name, reply.path))
}
