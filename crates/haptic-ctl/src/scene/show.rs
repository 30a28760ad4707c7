//! `scene show`: a scene as TOML.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, SceneReply};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Scene: a name of the library, a revision as @42, or a FILE.toml [default: active]
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,
}

impl Arguments {
    pub(super) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::Get {
            scene: reference::read_optional(self.scene.as_ref())?,
        })
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: SceneReply = reference::ask(daemon, request).await?;
    if json {
        return output::json(&reply.scene);
    }
    let text = toml::to_string(&reply.scene).map_err(std::io::Error::other)?;
    output::line(text.trim_end())
}
