//! `recording`: what to do with recordings. Works without a daemon.

pub(crate) mod copy;
pub(crate) mod cut;
mod export;
mod info;
mod repair;
pub(crate) mod report;
pub(crate) mod summary;

use crate::failure::Failure;
use haptic_lab::recording::RecordingError;
use std::path::Path;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what a recording holds: when, of which rig, scenes, states, gaps, markers, notes, and how it ends
    Info(info::Arguments),
    /// Write a recording that was broken off or is damaged anew, as far as it can be read
    Repair(repair::Arguments),
    /// Write a recording in another format
    Export(export::Arguments),
    /// Write a part of a recording
    #[command(after_help = cut::HELP)]
    Cut(cut::Arguments),
}

pub(crate) fn run(command: &Command, json: bool) -> Result<(), Failure> {
    match command {
        Command::Info(arguments) => info::run(arguments, json),
        Command::Repair(arguments) => repair::run(arguments, json),
        Command::Export(arguments) => export::run(arguments, json),
        Command::Cut(arguments) => cut::run(arguments, json),
    }
}

/// The failure to read a recording, with its name.
fn unreadable(path: &Path, error: &RecordingError) -> Failure {
    Failure::Usage(match error {
        // Its text has the name already.
        RecordingError::Open { .. } => error.to_string(),
        _ => format!("{}: {error}", path.display()),
    })
}

/// The failure to read a recording to its end.
fn damaged(path: &Path, error: &RecordingError) -> Failure {
    let path = path.display();
    Failure::Usage(format!(
        "{path}: {error}; `haptic-ctl recording repair {path} OUT` keeps what comes before"
    ))
}
