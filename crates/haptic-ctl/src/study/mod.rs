//! `study`: the targeting task and the perception tests.

mod analyse;

use crate::failure::Failure;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what a study's trials say: the paper's tables and figures, throughput by ISO 9241-411, thresholds
    #[command(after_help = analyse::HELP)]
    Analyse(analyse::Arguments),
}

pub(crate) fn run(command: &Command, json: bool) -> Result<(), Failure> {
    match command {
        Command::Analyse(arguments) => analyse::run(arguments, json),
    }
}
