//! `events`: what the daemon reports as it happens: changes of state, the journal, samples, timing.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{log, output, sample_table};
use clap::ValueEnum;
use haptic_ipc::{Event, LogReply, Request, SamplesEvent, StateEvent, SubscribeReply};
use serde_json::{Value, json};

/// For the help text.
pub(crate) const HELP: &str = "\
Examples:
  haptic-ctl events                          changes of state and entries of the journal
  haptic-ctl events log --past 20            the newest 20 entries, and those that come
  haptic-ctl events samples --rate 100       a table of samples
  haptic-ctl events samples --rate all --json | head

With --json each line is an object whose `event` is state, servo, timing, samples or log. A line of samples is one \
sample by the names of its columns; `dropped` in it counts the samples that were lost before it.";

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// What to show [default: state log]
    #[arg(value_enum, value_name = "TOPIC")]
    topics: Vec<Topic>,

    /// Rate of samples, Hz, or `all` for every tick
    #[arg(long, value_name = "HZ", default_value = "10", allow_hyphen_values = true)]
    rate: Rate,

    /// Begin with the newest N entries of the journal
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true)]
    past: usize,

    /// Number of events, each sample being one [default: until interrupted]
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Topic {
    /// Changes of the rig's state
    State,
    /// Entries of the journal: who changed what, faults, devices that come and go
    Log,
    /// Samples of the ticks
    Samples,
    /// How well the loop keeps time, once a second
    Timing,
}

#[derive(Clone, Copy, Debug)]
enum Rate {
    All,
    Hz(f64),
}

impl std::str::FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            _ => match text.parse::<f64>() {
                Ok(rate) if rate.is_finite() => Ok(Self::Hz(rate)),
                _ => Err(format!("`{text}` is neither a number of hertz nor `all`")),
            },
        }
    }
}

impl Arguments {
    /// What it subscribes to.
    pub(crate) fn subscription(&self) -> Result<Request, Failure> {
        let mut topics = self.topics.clone();
        if topics.is_empty() {
            topics.extend([Topic::State, Topic::Log]);
        }
        let has_samples = topics.contains(&Topic::Samples);
        if self.past > 0 && !topics.contains(&Topic::Log) {
            return Err(Failure::Usage(format!(
                "--past = {}: it is of the journal, whose topic is not asked for: write `haptic-ctl events log --past {}`",
                self.past, self.past
            )));
        }
        Ok(Request::Subscribe {
            topics: topics.into_iter().map(Topic::of_protocol).collect(),
            rate_hz: match self.rate {
                Rate::Hz(rate) if has_samples => Some(rate),
                _ => None,
            },
            batch_ms: None,
        })
    }
}

impl Topic {
    const fn of_protocol(self) -> haptic_ipc::Topic {
        match self {
            Self::State => haptic_ipc::Topic::State,
            Self::Log => haptic_ipc::Topic::Log,
            Self::Samples => haptic_ipc::Topic::Samples,
            Self::Timing => haptic_ipc::Topic::Timing,
        }
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    // Subscribed first: nothing falls between what was and what comes.
    let _: SubscribeReply = daemon.ask(arguments.subscription()?).await?;
    let mut printer = Printer {
        json,
        left: arguments.count.unwrap_or(u64::MAX),
        newest_entry: 0,
        state: String::new(),
    };
    if !json && arguments.topics.contains(&Topic::Samples) {
        output::unless_quiet(&sample_table::header())?;
    }
    if arguments.past > 0 {
        let past = Request::Log {
            after: None,
            limit: Some(arguments.past),
        };
        let reply: LogReply = daemon.ask(past).await?;
        for entry in reply.entries {
            printer.print(&Event::Log(Box::new(entry)))?;
        }
    }
    while printer.left > 0 {
        printer.print(&daemon.next_event().await?)?;
    }
    Ok(())
}

struct Printer {
    json: bool,
    /// Events that are still wanted.
    left: u64,
    /// The newest entry that was printed.
    newest_entry: u64,
    /// The text of the newest state.
    state: String,
}

impl Printer {
    fn print(&mut self, event: &Event) -> Result<(), Failure> {
        match event {
            _ if self.left == 0 => return Ok(()),
            Event::Samples(batch) => return self.print_samples(batch),
            Event::Log(entry) if entry.seq <= self.newest_entry => return Ok(()),
            Event::Log(entry) => self.newest_entry = entry.seq,
            Event::Unknown => return Ok(()),
            _ => {}
        }
        if self.json {
            self.left -= 1;
            return output::json(event);
        }
        let text = match event {
            Event::State(state) => {
                // A change of the scene alone is in the journal.
                let text = state_text(state);
                if text == self.state {
                    return Ok(());
                }
                self.state.clone_from(&text);
                format!("{text}  tick {}", state.tick)
            }
            Event::Log(entry) => log::text(entry),
            Event::Timing(timing) => {
                let counts = &timing.since_start;
                format!(
                    "timing  {} ticks, {}, {}, {} lost",
                    counts.ticks,
                    output::count(counts.overruns, "overrun"),
                    output::count(counts.missed_periods, "missed period"),
                    output::count(counts.telemetry_dropped, "sample")
                )
            }
            Event::Servo(servo) => format!("servo  other settings from tick {}", servo.tick),
            Event::Samples(_) | Event::Snapshot(_) | Event::Unknown => return Ok(()),
        };
        self.left -= 1;
        output::line(&text)
    }

    fn print_samples(&mut self, batch: &SamplesEvent) -> Result<(), Failure> {
        let Some(first) = batch.rows.first() else {
            return Ok(());
        };
        if batch.dropped > 0 && !self.json {
            eprintln!(
                "haptic-ctl: {} were lost before tick {}",
                output::count(batch.dropped, "sample"),
                first.tick
            );
        }
        let shown = usize::try_from(self.left).unwrap_or(usize::MAX).min(batch.rows.len());
        let mut dropped = batch.dropped;
        let lines: Result<Vec<String>, Failure> = batch.rows[..shown]
            .iter()
            .map(|sample| {
                if !self.json {
                    return Ok(sample_table::row(sample));
                }
                let mut object = sample.to_object();
                object.insert("event".to_owned(), json!("samples"));
                object.insert("dropped".to_owned(), json!(std::mem::take(&mut dropped)));
                output::json_text(&Value::Object(object))
            })
            .collect();
        self.left -= shown as u64;
        // One write a batch keeps up with every tick of a fast loop.
        output::line(&lines?.join("\n"))
    }
}

fn state_text(state: &StateEvent) -> String {
    match &state.fault {
        Some(fault) => format!("state  {}: {fault}", state.state),
        None => format!("state  {}", state.state),
    }
}
