//! `record`: every tick into a file, with what happened meanwhile.

mod link_watch;
mod person;
mod tick_clock;
mod under_way;
mod upsets;

pub(crate) use under_way::{RecordingUnderWay, subscribe};

use crate::condition::{Condition, Observations};
use crate::console::Signals;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::recording::summary::Summary;
use crate::units::duration;
use crate::{complete, hint, output, progress, recording, units};
use clap::ValueHint;
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Event, Request, Topic, regular_file};
use haptic_recording::{Format, Mark, Metadata, Totals};
use indicatif::ProgressBar;
use link_watch::LinkWatch;
use person::{Input, Person};
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tick_clock::TickClock;
use upsets::Upsets;

pub(crate) const HELP: &str = "\
The file's ending is its format: .mcap for robotics tools, .csv for any program, .parquet for the smallest file.

Examples:
  haptic-ctl record rig.mcap --for 10s --notes 'steel on Teflon'
  haptic-ctl record - --for 10s | python3 analyse.py

On a terminal, m and 1 to 9 set a marker, and q ends the recording. No key stops the rig: use `haptic-ctl stop`.";

/// Largest notes, bytes. They stand in one line of a CSV.
const MAX_NOTES: u64 = 1 << 16;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording: a new file in .mcap, .csv or .parquet; or `-` for standard output
    #[arg(value_hint = ValueHint::FilePath)]
    file: PathBuf,

    /// Duration, as in 10s [default: until interrupted]
    #[arg(long = "for", value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    length: Option<Duration>,

    /// End when a condition of `wait` holds, as in state=stopped
    #[arg(long, value_name = "CONDITION", add = ArgValueCompleter::new(complete::conditions))]
    until: Option<Condition>,

    /// Rate of samples, as in 100Hz [default: every tick]
    #[arg(long, value_name = "RATE", value_parser = units::rate, allow_hyphen_values = true)]
    rate: Option<f64>,

    /// Notes to keep in the recording
    #[arg(long, value_name = "TEXT")]
    notes: Option<String>,

    /// File of these notes
    #[arg(long, value_name = "FILE", conflicts_with = "notes", value_hint = ValueHint::FilePath)]
    notes_file: Option<PathBuf>,

    /// Set a marker for each line of standard input; its end ends the recording unless --for or --until does
    #[arg(long)]
    markers_from_stdin: bool,

    /// Format on standard output [default: csv]
    #[arg(long, value_enum)]
    format: Option<StreamFormat>,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

impl Arguments {
    /// What it subscribes to; a wrong command line is refused.
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        if self.length == Some(Duration::ZERO) {
            return Err(Failure::Usage(
                "--for = 0 s: a recording of no time holds nothing; give it a longer one, as in 10s".to_owned(),
            ));
        }
        match self.streamed() {
            Some(format) => check_stream(format)?,
            None => self.check_file()?,
        }
        Ok(self.subscription())
    }

    /// The format on standard output, where the recording goes there.
    fn streamed(&self) -> Option<StreamFormat> {
        (self.file == Path::new("-")).then(|| self.format.unwrap_or(StreamFormat::Csv))
    }

    fn check_file(&self) -> Result<(), Failure> {
        if self.format.is_some() {
            return Err(Failure::Usage(format!(
                "--format is for `-`, standard output; the ending of {} says its format",
                self.file.display()
            )));
        }
        Format::of(&self.file).map_err(|error| Failure::Usage(error.to_string()))?;
        if !self.force && self.file.exists() {
            return Err(Failure::exists(&self.file));
        }
        Ok(())
    }

    fn create(&self, metadata: &Metadata) -> Result<RecordingUnderWay, Failure> {
        match self.streamed() {
            Some(format) => RecordingUnderWay::to_standard_output(format.of_recording(), metadata),
            None => RecordingUnderWay::create(&self.file, metadata, self.force),
        }
    }

    fn subscription(&self) -> Request {
        // What is reported each second shows that the daemon is there, however slow the samples.
        let mut topics = vec![Topic::State, Topic::Log, Topic::Timing, Topic::Samples];
        if self.rate.is_none() {
            topics.push(Topic::Snapshot);
        }
        Request::Subscribe {
            topics,
            rate_hz: self.rate,
            batch_ms: Some(20),
        }
    }

    /// Whether it ends at a time or by a condition.
    fn has_end(&self) -> bool {
        self.length.is_some() || self.until.is_some()
    }

    fn notes(&self) -> Result<Option<String>, Failure> {
        let notes = match &self.notes_file {
            None => self.notes.clone(),
            Some(path) => Some(
                regular_file::read_text_of(path, MAX_NOTES)
                    .map_err(|error| Failure::Usage(format!("{}: {error}", path.display())))?,
            ),
        };
        match &notes {
            Some(text) if text.len() as u64 > MAX_NOTES => Err(Failure::Usage(format!(
                "--notes has {} bytes: at most {MAX_NOTES} are kept",
                text.len()
            ))),
            _ => Ok(notes),
        }
    }
}

/// A format that can be written into a pipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum StreamFormat {
    /// Lines of text, the metadata in those that begin with `#`
    Csv,
    /// MCAP, for robotics tools
    Mcap,
}

impl StreamFormat {
    const fn of_recording(self) -> Format {
        match self {
            Self::Csv => Format::Csv,
            Self::Mcap => Format::Mcap,
        }
    }
}

/// Refuses to write bytes to a terminal.
fn check_stream(format: StreamFormat) -> Result<(), Failure> {
    if format == StreamFormat::Mcap && io::stdout().is_terminal() {
        let why = "`-`: MCAP is not for a terminal; name a file, or pipe it into another program";
        return Err(Failure::Usage(why.to_owned()));
    }
    Ok(())
}

/// Why a recording ended.
enum End {
    /// The time or the condition of the command line was reached.
    Reached,
    /// By a signal, or by a key.
    Interrupted,
    /// The daemon is gone, or does not answer.
    Lost(Failure),
    /// The file cannot be written.
    NotWritten(io::Error),
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    // Caught from here on, so that the file gets its end.
    let mut signals = Signals::new()?;
    let notes = arguments.notes()?;
    let (status, metadata) = subscribe(daemon, arguments.subscription(), notes).await?;
    if let Some(condition) = &arguments.until {
        condition.check_axes(metadata.axes).map_err(Failure::Usage)?;
    }
    let recorder = arguments.create(&metadata)?;
    let mut session = RecordSession {
        arguments,
        recorder,
        link: LinkWatch::new(status.device.link.and_then(|link| link.device)),
        observations: Observations::default(),
        clock: TickClock::new(status.rate_hz),
        next_tick: status.tick,
        upsets: Upsets::new(status.state, status.rate_hz),
        markers: 0,
    };
    let end = session.record(daemon, &mut signals).await;
    session.end(end, &mut signals, json).await
}

/// A recording that runs.
struct RecordSession<'a> {
    arguments: &'a Arguments,
    recorder: RecordingUnderWay,
    link: LinkWatch,
    observations: Observations,
    clock: TickClock,
    /// The tick after the newest that was received.
    next_tick: u64,
    upsets: Upsets,
    markers: u64,
}

impl RecordSession<'_> {
    async fn record(&mut self, daemon: &mut Daemon, signals: &mut Signals) -> End {
        let mut person = Person::new(self.arguments.markers_from_stdin);
        let bar = progress::bar(self.arguments.length, person.keys());
        let end = loop {
            tokio::select! {
                event = daemon.regular_event() => {
                    if let Some(end) = self.take(event) {
                        break end;
                    }
                    let totals = self.recorder.totals();
                    bar.set_position(progress::position(totals.length_s));
                    bar.set_message(shown(&totals, self.markers));
                }
                Some(input) = person.next() => {
                    if let Some(end) = self.hear(input, &bar) {
                        break end;
                    }
                }
                _ = signals.next() => break End::Interrupted,
            }
        };
        bar.finish_and_clear();
        end
    }

    /// Takes an event; gives the reason where it is the last.
    fn take(&mut self, event: Result<Event, Failure>) -> Option<End> {
        let mut event = match event {
            Ok(event) => event,
            Err(failure) => {
                let text = format!("lost the daemon: {failure}");
                self.recorder.mark(Mark::Link {
                    tick: self.next_tick,
                    text,
                });
                return Some(End::Lost(failure));
            }
        };
        let length = self.arguments.length;
        let is_full = length.is_some_and(|length| cut(&mut event, self.recorder.first_s(), length));
        match &event {
            Event::Samples(samples) => {
                if let Some(newest) = samples.rows.last() {
                    self.clock.take(newest);
                    self.next_tick = self.next_tick.max(newest.tick + 1);
                }
            }
            // Changes overtake the rows on their way. A marker that is set after a change comes after it.
            Event::State(state) => self.next_tick = self.next_tick.max(state.tick),
            Event::Log(entry) => self.next_tick = self.next_tick.max(entry.tick.unwrap_or(0)),
            _ => {}
        }
        for mark in self.link.marks(&event, self.next_tick) {
            self.recorder.mark(mark);
        }
        self.upsets.take(&event);
        self.recorder.event(&event);
        if matches!(event, Event::Timing(_)) {
            self.recorder.flush();
        }
        if let Err(error) = self.recorder.check() {
            return Some(End::NotWritten(error));
        }
        let until = self.arguments.until.as_ref();
        let holds = until.is_some_and(|condition| self.observations.take(event, condition));
        (is_full || holds).then_some(End::Reached)
    }

    /// Takes what a person wants; gives the reason where that is the end.
    fn hear(&mut self, input: Input, bar: &ProgressBar) -> Option<End> {
        match input {
            Input::Marker(text) => {
                self.markers += 1;
                let text = text.unwrap_or_else(|| format!("marker {}", self.markers));
                bar.set_prefix(format!("marker `{text}`; {}", person::KEYS));
                // The rows of this moment are still on their way.
                let tick = self.next_tick.max(self.clock.next_tick().unwrap_or(0));
                self.recorder.mark(Mark::Marker { tick, text });
                None
            }
            Input::OtherKey => {
                bar.set_prefix(hint::addressed(person::OTHER_KEY));
                None
            }
            Input::End => Some(End::Interrupted),
            // A time or a condition that was asked for comes first.
            Input::LastLine => (!self.arguments.has_end()).then_some(End::Reached),
        }
    }

    async fn end(self, end: End, signals: &mut Signals, json: bool) -> Result<(), Failure> {
        let (file, markers) = (&self.arguments.file, self.markers);
        let recorder = self.recorder;
        let written = async {
            match end {
                End::NotWritten(error) => (Err(error), None, false),
                End::Lost(failure) => (recorder.break_off().await, Some(failure), false),
                End::Reached => (recorder.finish().await, None, true),
                End::Interrupted => {
                    // Without a time or a condition, an interrupt is how a recording ends.
                    let is_early = self.arguments.has_end();
                    (recorder.finish().await, is_early.then_some(Failure::Interrupted), true)
                }
            }
        };
        let (written, failure, is_complete) = tokio::select! {
            biased;
            written = written => written,
            // Nobody need wait for a disk that hangs.
            _ = signals.next() => return Err(Failure::Interrupted),
        };
        let is_streamed = self.arguments.streamed().is_some();
        let totals = match written {
            Err(error) if is_streamed => return Err(Failure::Output(error)),
            written => written.map_err(|error| not_written(file, &error))?,
        };
        let ending = if is_complete { "" } else { "; without an end" };
        let upsets = &self.upsets;
        let summary = format!("{}: {}{upsets}{ending}", file.display(), shown(&totals, markers));
        let mut summary_json = recording::as_json(file, &totals);
        summary_json["markers"] = markers.into();
        for (name, number) in upsets.counts() {
            summary_json[name] = number.into();
        }
        summary_json["complete"] = is_complete.into();
        match (is_streamed, json) {
            (true, true) => eprintln!("{}", output::json_text(&summary_json)?),
            (true, false) if !output::is_quiet() => eprintln!("haptic-ctl: {summary}"),
            (true, false) => {}
            (false, true) => output::json(&summary_json)?,
            (false, false) if !output::is_quiet() => output::text(&summary)?,
            (false, false) => {}
        }
        failure.map_or(Ok(()), Err)
    }
}

fn shown(totals: &Totals, markers: u64) -> String {
    let text = recording::as_text(totals);
    match markers {
        0 => text,
        _ => format!("{text}, {}", output::count(markers, "marker")),
    }
}

/// The failure to write a recording, with how much of it there is.
fn not_written(file: &Path, error: &io::Error) -> Failure {
    let name = file.display();
    Failure::File(match Summary::read(file) {
        Ok(summary) => format!(
            "{name}: {error}; the recording ends there: {:.3} s, {} rows, which read",
            summary.length_s(),
            summary.rows
        ),
        Err(unreadable) => format!("{name}: {error}; nothing of it reads: {unreadable}"),
    })
}

/// Takes the samples beyond the length out of an event; says whether the length has been reached.
fn cut(event: &mut Event, first_s: Option<f64>, length: Duration) -> bool {
    let Event::Samples(samples) = event else { return false };
    let Some(first_s) = first_s.or(samples.rows.first().map(|row| row.t_s)) else {
        return false;
    };
    // Times of ticks are not exact to the last bit; a tenth of the shortest period is.
    let end_s = first_s + length.as_secs_f64() - 5e-6;
    let kept = samples.rows.partition_point(|row| row.t_s < end_s);
    let full = kept < samples.rows.len();
    samples.truncate(kept);
    full
}
