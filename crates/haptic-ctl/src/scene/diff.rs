//! `scene diff`: in what two scenes differ.

use super::reference;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, SceneDiffReply};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[arg(help = reference::HELP, add = ArgValueCompleter::new(complete::scenes))]
    from: String,

    /// The other, likewise [default: active]
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    to: Option<String>,
}

impl Arguments {
    pub(super) fn request(&self) -> Result<Request, Failure> {
        Ok(Request::SceneDiff {
            from: reference::read(&self.from)?,
            to: reference::read_optional(self.to.as_ref())?,
        })
    }
}

pub(super) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
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
