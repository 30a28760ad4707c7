//! `recording export`: the same recording in another format.

use super::copy::Output;
use super::{damaged, unreadable};
use crate::failure::Failure;
use crate::progress;
use clap::ValueHint;
use haptic_lab::recording::{self, Ending, Entry};
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
    let bar = progress::busy("exporting");
    let mut reader = recording::open(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    let mut copy = arguments.output.create(&arguments.file, reader.metadata())?;
    while let Some(entry) = reader
        .next()
        .transpose()
        .map_err(|error| damaged(&arguments.file, &error))?
    {
        match entry {
            Entry::Row(row) => copy.row(row)?,
            Entry::Mark(mark) => copy.mark(&mark)?,
        }
    }
    let report = copy.end(reader.ending() == Some(Ending::Complete))?;
    bar.finish_and_clear();
    report.show(json)
}
