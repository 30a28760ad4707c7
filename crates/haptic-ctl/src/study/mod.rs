//! `study`: the targeting task and the perception tests, one file a subcommand.

mod add;
mod analyse;
mod new;
mod plan;
mod run;
mod subjects;

use crate::failure::Failure;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a study for people, which they do in the panel
    #[command(after_help = new::HELP)]
    New(new::Arguments),
    /// Add subjects to a study; those that it has keep their orders and data
    #[command(after_help = add::HELP)]
    Add(add::Arguments),
    /// Run a whole study unattended, by simulated operators, faster than real time
    #[command(after_help = run::HELP)]
    Run(run::Arguments),
    /// Continue an interrupted study; of a study by people, show how far it is
    Resume(Resume),
    /// Print a plan, to be changed and run
    Plan(plan::Arguments),
    /// Analyse trials: tables and figures, throughput by ISO 9241-411, thresholds
    #[command(after_help = analyse::help())]
    Analyse(analyse::Arguments),
}

#[derive(Debug, Args)]
pub(crate) struct Resume {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(crate) async fn run(command: &Command, as_json: bool) -> Result<(), Failure> {
    match command {
        Command::New(arguments) => new::run(arguments, as_json),
        Command::Add(arguments) => add::run(arguments, as_json),
        Command::Run(arguments) => run::run(arguments, as_json).await,
        Command::Resume(resume) => run::resume(&resume.folder, as_json).await,
        Command::Plan(arguments) => plan::run(arguments),
        Command::Analyse(arguments) => analyse::run(arguments, as_json),
    }
}
