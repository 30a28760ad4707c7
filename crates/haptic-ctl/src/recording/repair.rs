//! `recording repair`: what can be read of a recording, as one with an end.

use super::copy::Output;
use super::unreadable;
use crate::failure::Failure;
use crate::progress;
use clap::ValueHint;
use haptic_lab::recording::{self, Ending, Entry, Mark};
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
    let bar = progress::busy("repairing");
    let mut reader = recording::open(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    let mut copy = arguments.output.create(&arguments.file, reader.metadata())?;
    let mut next_tick = 0;
    let damage = loop {
        match reader.next() {
            Some(Ok(Entry::Row(row))) => {
                next_tick = row.tick + 1;
                copy.row(row)?;
            }
            Some(Ok(Entry::Mark(mark))) => copy.mark(&mark)?,
            Some(Err(error)) => break Some(error.to_string()),
            None => break None,
        }
    };
    let ending = reader.ending().unwrap_or(Ending::Open);
    let why = damage.or((ending != Ending::Complete).then(|| ending.to_string()));
    if let Some(why) = &why {
        copy.mark(&Mark::Link {
            tick: next_tick,
            text: format!("the recording was broken off here: {why}"),
        })?;
    }
    let report = copy.end(true)?;
    bar.finish_and_clear();
    if let Some(why) = why {
        eprintln!("haptic-ctl: {}: {why}", arguments.file.display());
    }
    report.show(json)
}
