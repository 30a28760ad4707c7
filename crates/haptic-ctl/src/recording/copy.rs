//! `recording export` and `recording repair`: the whole recording once more, in another format, or as far as it can be
//! read and with an end.

use super::{Output, as_json, as_text, not_copied, not_repaired, show};
use crate::failure::Failure;
use crate::{output, progress};
use clap::ValueHint;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording to read
    #[arg(value_hint = ValueHint::FilePath)]
    file: PathBuf,

    #[command(flatten)]
    output: Output,
}

pub(super) fn export(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let Output { out, force } = &arguments.output;
    let bar = progress::busy("exporting");
    let totals = haptic_recording::export(&arguments.file, out, *force).map_err(|error| not_copied(&error))?;
    bar.finish_and_clear();
    show(out, &totals, json)
}

pub(super) fn repair(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let Output { out, force } = &arguments.output;
    let bar = progress::busy("repairing");
    let repaired = haptic_recording::repair(&arguments.file, out, *force).map_err(|error| not_repaired(&error))?;
    bar.finish_and_clear();
    let (ending, dropped) = (repaired.ending.to_string(), repaired.dropped_bytes);
    if json {
        let mut summary = as_json(out, &repaired.totals);
        summary["ending_before"] = ending.into();
        summary["dropped_bytes"] = dropped.into();
        return output::json(&summary);
    }
    output::text(&format!(
        "{}: {}\n{}: {ending}; {dropped} bytes could not be read",
        out.display(),
        as_text(&repaired.totals),
        arguments.file.display()
    ))
}
