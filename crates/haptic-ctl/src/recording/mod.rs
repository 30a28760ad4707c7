//! `recording`: what to do with recordings. Works without a daemon.

mod collect;
mod cut;
mod export;
pub(crate) mod file_failure;
mod info;
mod output;
mod repair;
pub(crate) mod report;
pub(crate) mod summary;

use crate::failure::Failure;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what a recording holds: when, of which rig, scenes, states, gaps, markers, notes, and how it ends
    Info(info::Arguments),
    /// Rewrite a recording that was broken off or is damaged, as far as it can be read
    Repair(repair::Arguments),
    /// Write a recording in another format
    Export(export::Arguments),
    /// Collect recordings of many rigs into one Parquet set, partitioned by rig and date
    #[command(after_help = collect::HELP)]
    Collect(collect::Arguments),
    /// Write a part of a recording
    #[command(after_help = cut::HELP)]
    Cut(cut::Arguments),
}

pub(crate) fn run(command: &Command, json: bool) -> Result<(), Failure> {
    match command {
        Command::Info(arguments) => info::run(arguments, json),
        Command::Repair(arguments) => repair::run(arguments, json),
        Command::Export(arguments) => export::run(arguments, json),
        Command::Collect(arguments) => collect::run(arguments, json),
        Command::Cut(arguments) => cut::run(arguments, json),
    }
}
