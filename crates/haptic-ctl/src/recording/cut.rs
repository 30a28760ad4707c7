//! `recording cut`: a part of a recording, as a recording of its own.

use super::summary::{EventKind, Summary};
use super::{Output, not_copied, show, unreadable};
use crate::failure::Failure;
use crate::progress;
use crate::units::duration;
use clap::ValueHint;
use haptic_core::nearest::meant_or_semicolon;
use haptic_lab::replay;
use haptic_recording::{Mark, Span};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(super) const HELP: &str = "\
Times are from the recording's first row; the row at the end is left out. Where it can, the part begins with a \
snapshot of the servo, for `haptic-ctl replay`.

Example:
  haptic-ctl recording cut rig.mcap slide.csv --from-marker 1 --to 5s";

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording to read
    #[arg(value_hint = ValueHint::FilePath)]
    file: PathBuf,

    #[command(flatten)]
    output: Output,

    /// Beginning, as in 2s [default: that of the recording]
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    from: Option<Duration>,

    /// End, as in 5s [default: that of the recording]
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    to: Option<Duration>,

    /// Begin at the first marker of this text
    #[arg(long, value_name = "TEXT", conflicts_with = "from")]
    from_marker: Option<String>,

    /// End at the first marker of this text
    #[arg(long, value_name = "TEXT", conflicts_with = "to")]
    to_marker: Option<String>,
}

/// Times of ticks are not exact to the last bit; a tenth of the shortest period is.
const SAME_TIME_S: f64 = 5e-6;

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let Output { out, force } = &arguments.output;
    let bar = progress::busy("cutting");
    let span = span(arguments)?;
    let snapshot = snapshot(&arguments.file, span.start)?;
    let cut = haptic_recording::cut(&arguments.file, out, &Span::Time(span), *force, snapshot.as_ref());
    let totals = cut.map_err(|error| not_copied(&error))?;
    bar.finish_and_clear();
    show(out, &totals, json)
}

/// The servo's state where the part begins, if it follows from the recording.
fn snapshot(file: &Path, from_s: f64) -> Result<Option<Mark>, Failure> {
    let mut reader = haptic_recording::open_any(file).map_err(|error| unreadable(file, &error))?;
    let metadata = reader.metadata().clone();
    // What cannot be replayed is cut all the same.
    Ok(replay::snapshot_at(&metadata, reader.by_ref(), from_s).unwrap_or_default())
}

/// What is kept, s from the first row.
fn span(arguments: &Arguments) -> Result<Range<f64>, Failure> {
    let markers = match (&arguments.from_marker, &arguments.to_marker) {
        (None, None) => Vec::new(),
        _ => markers(arguments)?,
    };
    let time = |time: Option<Duration>, marker: &Option<String>, default: f64| match (time, marker) {
        (Some(time), _) => Ok(time.as_secs_f64()),
        (None, Some(text)) => find(arguments, &markers, text),
        (None, None) => Ok(default),
    };
    let from_s = time(arguments.from, &arguments.from_marker, 0.0)?;
    let to_s = time(arguments.to, &arguments.to_marker, f64::INFINITY)?;
    if to_s <= from_s {
        return Err(Failure::Usage(format!(
            "the part ends at {to_s:.3} s, and begins at {from_s:.3} s: the end must come after the beginning"
        )));
    }
    Ok(from_s - SAME_TIME_S..to_s - SAME_TIME_S)
}

/// Times and texts of the markers.
fn markers(arguments: &Arguments) -> Result<Vec<(f64, String)>, Failure> {
    let summary = Summary::read(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    Ok(summary
        .events
        .into_iter()
        .filter_map(|event| match event.what {
            EventKind::Marker { text } => Some((event.t_s, text)),
            _ => None,
        })
        .collect())
}

fn find(arguments: &Arguments, markers: &[(f64, String)], text: &str) -> Result<f64, Failure> {
    let found = markers.iter().find(|(_, marker)| marker == text);
    found.map(|(t_s, _)| *t_s).ok_or_else(|| {
        let known: Vec<&str> = markers.iter().map(|(_, marker)| marker.as_str()).collect();
        let there: Vec<String> = known.iter().map(|marker| format!("`{marker}`")).collect();
        let there = if there.is_empty() {
            "none".to_owned()
        } else {
            there.join(", ")
        };
        Failure::Usage(format!(
            "{}: there is no marker `{text}`{} its markers: {there}",
            arguments.file.display(),
            meant_or_semicolon(text, &known)
        ))
    })
}
