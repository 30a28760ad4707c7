//! `scene load`: a whole scene comes into force.

use super::reference;
use crate::change::{self, How, Shown};
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
    how: How,
}

impl Arguments {
    pub(super) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::SceneLoad {
            scene: reference::read(&self.scene)?,
            if_revision: self.how.if_revision,
            ramp_ms: self.how.ramp_ms(),
            dry_run: self.how.dry_run,
        })
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: ChangeReply = reference::ask(daemon, request).await?;
    change::show(&reply, Shown::Differences, json)
}
