//! `recording cut`: a part of a recording, as a recording of its own.

use super::copy::{Copy, Output};
use super::summary::{Summary, What};
use super::{damaged, unreadable};
use crate::duration::duration;
use crate::failure::Failure;
use crate::progress;
use clap::ValueHint;
use haptic_ipc::Sample;
use haptic_lab::recording::{self, Ending, Entry, Mark, Metadata};
use std::path::PathBuf;
use std::time::Duration;

/// For the help text.
pub(crate) const HELP: &str = "\
Times are from the recording's first row; a row at the beginning is in the part, and one at the end is not. The part \
begins with the scene and the state that its first row had. Where it begins under force, its forces cannot be computed \
again to the last bit: that needs what came before.";

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
    let bar = progress::busy("cutting");
    let range = Range::new(arguments)?;
    let mut reader = recording::open(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    let mut part = Part {
        arguments,
        metadata: reader.metadata().clone(),
        state: None,
        marks: Vec::new(),
        copy: None,
    };
    let (mut first_s, mut last_s, mut is_whole) = (None, 0.0, true);
    while let Some(entry) = reader
        .next()
        .transpose()
        .map_err(|error| damaged(&arguments.file, &error))?
    {
        match entry {
            Entry::Row(row) => {
                last_s = row.t_s - *first_s.get_or_insert(row.t_s);
                if last_s >= range.to_s {
                    is_whole = false;
                    break;
                }
                part.row(row, last_s >= range.from_s)?;
            }
            Entry::Mark(mark) => part.marks.push(mark),
        }
    }
    // Where the end was cut off, the part has an end of its own.
    let is_complete = !is_whole || reader.ending() == Some(Ending::Complete);
    let Some(mut copy) = part.copy else {
        let file = arguments.file.display();
        let (from_s, to_s) = (range.from_s + SAME_TIME_S, range.to_s + SAME_TIME_S);
        return Err(Failure::Usage(format!(
            "{file}: there is no row from {from_s:.3} s to {to_s:.3} s; its last one is at {last_s:.3} s"
        )));
    };
    if is_whole {
        for mark in &part.marks {
            copy.mark(mark)?;
        }
    }
    let report = copy.end(is_complete)?;
    bar.finish_and_clear();
    report.show(json)
}

/// What is kept, s from the first row.
struct Range {
    from_s: f64,
    to_s: f64,
}

impl Range {
    fn new(arguments: &Arguments) -> Result<Self, Failure> {
        let markers = match (&arguments.from_marker, &arguments.to_marker) {
            (None, None) => Vec::new(),
            _ => markers(arguments)?,
        };
        let time = |time: Option<Duration>, marker: &Option<String>, default: f64| match (time, marker) {
            (Some(time), _) => Ok(time.as_secs_f64() - SAME_TIME_S),
            (None, Some(text)) => find(arguments, &markers, text).map(|t_s| t_s - SAME_TIME_S),
            (None, None) => Ok(default),
        };
        let range = Self {
            from_s: time(arguments.from, &arguments.from_marker, f64::NEG_INFINITY)?,
            to_s: time(arguments.to, &arguments.to_marker, f64::INFINITY)?,
        };
        if range.to_s <= range.from_s {
            return Err(Failure::Usage(format!(
                "the part ends at {:.3} s, and begins at {:.3} s: the end must come after the beginning",
                range.to_s + SAME_TIME_S,
                range.from_s + SAME_TIME_S
            )));
        }
        Ok(range)
    }
}

/// Times and texts of the markers.
fn markers(arguments: &Arguments) -> Result<Vec<(f64, String)>, Failure> {
    let summary = Summary::read(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    Ok(summary
        .events
        .into_iter()
        .filter_map(|event| match event.what {
            What::Marker { text } => Some((event.t_s, text)),
            _ => None,
        })
        .collect())
}

fn find(arguments: &Arguments, markers: &[(f64, String)], text: &str) -> Result<f64, Failure> {
    let found = markers.iter().find(|(_, marker)| marker == text);
    found.map(|(t_s, _)| *t_s).ok_or_else(|| {
        let there: Vec<String> = markers.iter().map(|(_, marker)| format!("`{marker}`")).collect();
        let there = if there.is_empty() {
            "none".to_owned()
        } else {
            there.join(", ")
        };
        Failure::Usage(format!(
            "{}: there is no marker `{text}`; its markers: {there}",
            arguments.file.display()
        ))
    })
}

/// The part that is written, from its first row on.
struct Part<'a> {
    arguments: &'a Arguments,
    /// With the scene before the next row.
    metadata: Metadata,
    /// The state before the next row.
    state: Option<Mark>,
    /// Marks that no row has come up to.
    marks: Vec<Mark>,
    copy: Option<Copy<'a>>,
}

impl Part<'_> {
    fn row(&mut self, row: Sample, is_kept: bool) -> Result<(), Failure> {
        if !is_kept {
            self.before();
            return Ok(());
        }
        if self.copy.is_none() {
            self.begin(row)?;
        }
        if let Some(copy) = &mut self.copy {
            for mark in self.marks.drain(..) {
                copy.mark(&mark)?;
            }
            copy.row(row)?;
        }
        Ok(())
    }

    /// Takes up what the marks before a row changed.
    fn before(&mut self) {
        for mark in self.marks.drain(..) {
            match mark {
                Mark::Scene {
                    revision,
                    arrival: Some(arrival),
                    ..
                } => {
                    self.metadata.revision = revision;
                    self.metadata.scene = arrival.scene;
                }
                state @ Mark::State { .. } => self.state = Some(state),
                _ => {}
            }
        }
    }

    fn begin(&mut self, row: Sample) -> Result<(), Failure> {
        let markers: Vec<Mark> = self
            .marks
            .extract_if(.., |mark| matches!(mark, Mark::Marker { .. } | Mark::Link { .. }))
            .collect();
        self.before();
        let mut copy = self.arguments.output.create(&self.arguments.file, &self.metadata)?;
        if let Some(Mark::State { state, fault, .. }) = self.state.take() {
            let tick = row.tick;
            copy.mark(&Mark::State { tick, state, fault })?;
        }
        self.marks = markers;
        self.copy = Some(copy);
        Ok(())
    }
}
