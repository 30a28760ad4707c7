//! `scene delete`: a saved scene leaves the library.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, SceneSaveReply};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Name of a saved scene in the library
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    name: String,
}

impl Arguments {
    pub(super) fn request(&self) -> Request {
        Request::SceneDelete {
            name: self.name.clone(),
        }
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneSaveReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply);
    }
    output::unless_quiet(&format!("{} is deleted: {}", reply.name, reply.path))
}
