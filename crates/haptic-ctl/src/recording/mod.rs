//! `recording`: what to do with recordings. Works without a daemon.

mod collect;
mod copy;
mod cut;
mod info;
pub(crate) mod summary;

use crate::failure::Failure;
use crate::output::{self, count};
use clap::ValueHint;
use haptic_recording::{CopyError, CreateError, RecordingError, Totals};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show what a recording holds, and how it ends
    Info(info::Arguments),
    /// Rewrite a broken or damaged recording, as far as it can be read
    Repair(copy::Arguments),
    /// Write a recording in another format
    Export(copy::Arguments),
    /// Collect recordings into one Parquet set, partitioned by rig and date
    #[command(after_help = collect::HELP)]
    Collect(collect::Arguments),
    /// Write a part of a recording
    #[command(after_help = cut::HELP)]
    Cut(cut::Arguments),
}

pub(crate) fn run(command: &Command, json: bool) -> Result<(), Failure> {
    match command {
        Command::Info(arguments) => info::run(arguments, json),
        Command::Repair(arguments) => copy::repair(arguments, json),
        Command::Export(arguments) => copy::export(arguments, json),
        Command::Collect(arguments) => collect::run(arguments, json),
        Command::Cut(arguments) => cut::run(arguments, json),
    }
}

/// The recording that is written.
#[derive(Debug, clap::Args)]
pub(crate) struct Output {
    /// Recording to write, in .mcap, .csv or .parquet
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    pub(crate) force: bool,
}

/// The failure to read a recording, with its name.
pub(crate) fn unreadable(path: &Path, error: &RecordingError) -> Failure {
    Failure::Usage(match error {
        // Its text has the name already.
        RecordingError::Open { .. } => error.to_string(),
        _ => format!("{}: {error}{}", path.display(), error.remedy()),
    })
}

/// The failure to make a recording from another one.
pub(crate) fn not_copied(error: &CopyError) -> Failure {
    match error {
        CopyError::Read { source, .. } if source.is_damage() => Failure::Usage(format!("{error}{}", source.remedy())),
        _ => not_repaired(error),
    }
}

/// The same, where a repair has kept nothing.
pub(crate) fn not_repaired(error: &CopyError) -> Failure {
    match error {
        CopyError::Create(CreateError::File { path, source }) => Failure::not_created(path, source),
        CopyError::Write { .. } => Failure::File(error.to_string()),
        CopyError::Read { source, .. } if source.is_damage() => {
            Failure::Usage(format!("{error}; nothing of it can be read"))
        }
        _ => Failure::Usage(error.to_string()),
    }
}

/// Tells what was written.
fn show(out: &Path, totals: &Totals, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(&as_json(out, totals));
    }
    output::text(&format!("{}: {}", out.display(), as_text(totals)))
}

pub(crate) fn as_json(file: &Path, totals: &Totals) -> Value {
    json!({
        "file": file,
        "rows": totals.rows,
        "lost": totals.lost,
        "lost_changes": totals.lost_changes,
        "missed": totals.missed,
        "bytes": totals.bytes,
        "length_s": totals.length_s,
    })
}

/// Length, size and losses, for people.
pub(crate) fn as_text(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "a size in megabytes")]
    let megabytes = totals.bytes as f64 * 1e-6;
    let lost_changes = match totals.lost_changes {
        0 => String::new(),
        changes => format!(" and {}", count(changes, "change")),
    };
    format!(
        "{:.1} s, {}, {megabytes:.2} MB, {}{lost_changes} lost, {}",
        totals.length_s,
        count(totals.rows, "row"),
        totals.lost,
        count(totals.missed, "missed period")
    )
}
