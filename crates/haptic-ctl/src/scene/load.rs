//! `scene load`: load a whole scene.

use super::reference;
use crate::change::{Change, ChangeArguments, ChangeView};
use crate::complete;
use crate::daemon::Daemon;
use crate::failure::Failure;
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{ChangeReply, Request};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[arg(help = reference::HELP, add = ArgValueCompleter::new(complete::scenes))]
    scene: String,

    #[command(flatten)]
    change: ChangeArguments,
}

impl Arguments {
    pub(super) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::SceneLoad {
            scene: reference::read(&self.scene)?,
            options: self.change.options(),
        })
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let change = Change::prepare(daemon, &request, ChangeView::Differences, json).await?;
    let reply: ChangeReply = reference::ask(daemon, request).await?;
    change.finish(daemon, &reply).await
}
