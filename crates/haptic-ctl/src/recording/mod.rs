//! `recording`: what to do with recordings. Works without a daemon.

mod collect;
mod cut;
mod export;
mod info;
mod repair;
pub(crate) mod report;
pub(crate) mod summary;

use crate::failure::Failure;
use clap::ValueHint;
use haptic_recording::{CopyError, CreateError, RecordingError};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what a recording holds: when, of which rig, scenes, states, gaps, markers, notes, and how it ends
    Info(info::Arguments),
    /// Write a recording that was broken off or is damaged anew, as far as it can be read
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

/// The recording that is written.
#[derive(Debug, clap::Args)]
struct Output {
    /// Recording to write; its name ends in .mcap, .csv or .parquet
    #[arg(value_hint = ValueHint::FilePath)]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
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

/// The failure to read a recording, with its name.
fn unreadable(path: &Path, error: &RecordingError) -> Failure {
    Failure::Usage(match error {
        // Its text has the name already.
        RecordingError::Open { .. } => error.to_string(),
        _ => format!("{}: {error}", path.display()),
    })
}

/// The failure to make a recording from another one.
fn not_copied(error: &CopyError) -> Failure {
    match error {
        CopyError::Read { source, .. } if is_damage(source) => {
            Failure::Usage(format!("{error}; `haptic-ctl recording repair` keeps what can be read"))
        }
        _ => not_repaired(error),
    }
}

/// The same, where a repair has kept nothing.
fn not_repaired(error: &CopyError) -> Failure {
    match error {
        CopyError::Create(CreateError::File { path, source }) => Failure::not_created(path, source),
        CopyError::Write { .. } => Failure::File(error.to_string()),
        CopyError::Read { source, .. } if is_damage(source) => {
            Failure::Usage(format!("{error}; nothing of it can be read"))
        }
        _ => Failure::Usage(error.to_string()),
    }
}

/// Whether a file is a recording, of which a part cannot be read.
fn is_damage(error: &RecordingError) -> bool {
    !matches!(
        error,
        RecordingError::Open { .. }
            | RecordingError::NotARecording { .. }
            | RecordingError::OtherProgram { .. }
            | RecordingError::Version { .. }
    )
}
