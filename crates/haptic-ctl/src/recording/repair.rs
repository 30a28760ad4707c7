//! `recording repair`: what can be read of a recording, as one with an end.

use super::{Output, not_repaired};
use crate::failure::Failure;
use crate::{output, progress};
use clap::ValueHint;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording that was broken off, or is damaged
    #[arg(value_hint = ValueHint::FilePath)]
    file: PathBuf,

    #[command(flatten)]
    output: Output,
}

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let Output { out, force } = &arguments.output;
    let bar = progress::busy("repairing");
    let repaired = haptic_recording::repair(&arguments.file, out, *force).map_err(|error| not_repaired(&error))?;
    bar.finish_and_clear();
    let (ending, dropped) = (repaired.ending.to_string(), repaired.dropped_bytes);
    if json {
        let mut summary = super::as_json(out, &repaired.totals);
        summary["ending_before"] = ending.into();
        summary["dropped_bytes"] = dropped.into();
        return output::json(&summary);
    }
    output::text(&format!(
        "{}: {}\n{}: {ending}; {dropped} bytes could not be read",
        out.display(),
        super::as_text(&repaired.totals),
        arguments.file.display()
    ))
}
