//! `recording export`: the same recording in another format.

use super::{Output, not_copied};
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

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let Output { out, force } = &arguments.output;
    let bar = progress::busy("exporting");
    let totals = haptic_recording::export(&arguments.file, out, *force).map_err(|error| not_copied(&error))?;
    bar.finish_and_clear();
    if json {
        return output::json(&super::as_json(out, &totals));
    }
    output::text(&format!("{}: {}", out.display(), super::as_text(&totals)))
}
