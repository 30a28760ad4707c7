//! `identify`: finds mass and friction of what the rig's own motor moves.

mod excite;
mod plan;
mod rig;
mod run;
mod session;
mod ticks;

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::Request;
use haptic_lab::identify::{ModelKind, Options};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Move the rig by its own motor, and identify what is on it
    #[arg(long, required_unless_present = "rig")]
    run: bool,

    /// Measure the rig itself with its own motor, and store it
    #[arg(long, conflicts_with = "run")]
    rig: bool,

    /// Keep the rig's own mass and friction in what --run finds
    #[arg(long, requires = "run")]
    whole: bool,

    #[command(flatten)]
    excite: excite::Arguments,
}

impl Arguments {
    pub(crate) fn requests(&self) -> Vec<Request> {
        session::Session::requests(self.excite.range_m())
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    if arguments.rig {
        return rig::run(daemon, &arguments.excite, json).await;
    }
    let options = Options::new(ModelKind::Karnopp);
    let found = run::run(daemon, &arguments.excite, &options, arguments.whole).await?;
    output::json(&found)
}
