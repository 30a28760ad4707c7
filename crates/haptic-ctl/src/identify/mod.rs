//! `identify`: finds mass and friction of what moves, from a file or by the rig's own motor.

mod excite;
mod file;
mod interruption;
mod report;
mod rig;
mod run;
mod session;
mod ticks;

use crate::daemon::Daemon;
use crate::failure::Failure;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Move the rig by its own motor, and identify what is on it
    #[arg(long)]
    run: bool,

    /// Measure the rig itself with its own motor, and store it
    #[arg(long, conflicts_with = "run")]
    rig: bool,

    /// Keep the rig's own mass and friction in what --run finds
    #[arg(long, requires = "run")]
    whole: bool,

    /// Device positions are absolute, so cogging can be compensated
    #[arg(long, requires = "rig")]
    absolute_position: bool,

    #[command(flatten)]
    wanted: file::Wanted,

    #[command(flatten)]
    output: report::Arguments,

    #[command(flatten)]
    file: file::Arguments,

    #[command(flatten)]
    excite: excite::MotionArguments,
}

impl Arguments {
    /// Whether no daemon is needed.
    pub(crate) fn is_offline(&self) -> bool {
        self.file.path().is_some()
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    if arguments.rig {
        return rig::run(daemon, &arguments.excite, arguments.absolute_position, json).await;
    }
    arguments.output.check(std::iter::empty(), arguments.excite.force)?;
    let options = arguments.wanted.options();
    let identified = run::run(daemon, &arguments.excite, &options, arguments.whole).await?;
    let shown = report::show(&identified.found, json);
    arguments.output.write("the rig", &identified, json)?;
    shown
}

/// Identifies a file.
pub(crate) fn run_offline(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    match arguments.file.path() {
        Some(path) => {
            arguments
                .output
                .check(arguments.file.inputs(), arguments.excite.force)?;
            file::run(path, &arguments.file, &arguments.wanted, &arguments.output, json)
        }
        None => Ok(()),
    }
}
