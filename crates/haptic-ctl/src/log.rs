//! `log`: who changed what, and when; with `--follow` what the daemon reports as it happens: changes of state, the
//! journal, samples, timing.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{condition, output, units};
use clap::ValueEnum;
use haptic_ipc::{Event, JournalEntry, LogReply, Request, Sample, SampleY, SamplesEvent, StateEvent, SubscribeReply};
use jiff::tz::TimeZone;
use serde_json::{Value, json};

pub(crate) const HELP: &str = "\
Examples:
  haptic-ctl log -n 5                        the newest 5 entries of the journal
  haptic-ctl log -n 20 --follow              the newest 20, then all that come
  haptic-ctl log --follow samples --rate 100  a table of samples
  haptic-ctl log --follow samples --rate all --json | head

With --json each line is an object whose `event` is log, state, servo, timing or samples. A sample has its columns \
by name; its `dropped` counts the samples lost before it.";

/// Entries that are shown where none are followed.
const DEFAULT_LIMIT: usize = 20;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Newest entries of the journal to begin with [default: 20; 0 with --follow]
    #[arg(short = 'n', long, value_name = "N")]
    limit: Option<usize>,

    /// Show what comes, until interrupted [default: state log]
    #[arg(short, long, value_enum, value_name = "TOPIC", num_args = 0..)]
    follow: Option<Vec<Topic>>,

    /// Rate of samples, as in 100Hz, or `all` for every tick
    #[arg(
        long,
        value_name = "RATE",
        default_value = "10Hz",
        requires = "follow",
        allow_hyphen_values = true
    )]
    rate: Rate,

    /// Number of events or samples [default: until interrupted]
    #[arg(long, value_name = "N", requires = "follow")]
    count: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Topic {
    /// Changes of the rig's state
    State,
    /// Entries of the journal
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
            _ => units::rate(text)
                .map(Self::Hz)
                .map_err(|error| format!("{error}; `all` is every tick")),
        }
    }
}

impl Arguments {
    /// The first request: the subscription of what is followed, so that nothing falls between the past and it.
    pub(crate) fn request(&self) -> Request {
        match &self.follow {
            Some(topics) => self.subscription(topics),
            None => self.past(),
        }
    }

    fn past(&self) -> Request {
        let default = if self.follow.is_some() { 0 } else { DEFAULT_LIMIT };
        Request::Log {
            after: None,
            limit: Some(self.limit.unwrap_or(default)),
        }
    }

    fn subscription(&self, topics: &[Topic]) -> Request {
        let topics = if topics.is_empty() {
            &[Topic::State, Topic::Log][..]
        } else {
            topics
        };
        Request::Subscribe {
            topics: topics.iter().copied().map(Topic::of_protocol).collect(),
            rate_hz: match self.rate {
                Rate::Hz(rate) if topics.contains(&Topic::Samples) => Some(rate),
                _ => None,
            },
            batch_ms: None,
        }
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
    let mut printer = Printer {
        json,
        left: arguments.count.unwrap_or(u64::MAX),
        newest_entry: 0,
        state: String::new(),
    };
    let mut axes = 1;
    if arguments.follow.is_some() {
        let subscribed: SubscribeReply = daemon.ask(arguments.request()).await?;
        axes = subscribed.axes();
    }
    let past: LogReply = daemon.ask(arguments.past()).await?;
    let is_empty = past.entries.is_empty();
    for entry in past.entries {
        printer.print(&Event::Log(Box::new(entry)))?;
    }
    let Some(topics) = &arguments.follow else {
        if is_empty && !json && arguments.limit != Some(0) {
            output::unless_quiet("nothing has been changed since the daemon began")?;
        }
        return Ok(());
    };
    if !json && topics.contains(&Topic::Samples) {
        output::unless_quiet(header(axes))?;
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
            Event::Log(entry) => text(entry),
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
        let lines: Result<Vec<String>, Failure> = batch
            .ticks()
            .take(shown)
            .map(|(sample, y)| {
                if !self.json {
                    return Ok(row(sample, y));
                }
                let mut object = sample.to_object();
                object.extend(
                    y.into_iter()
                        .flat_map(|y| y.named().map(|(name, cell)| (name.to_owned(), json!(cell)))),
                );
                object.insert("event".to_owned(), json!("samples"));
                object.insert("dropped".to_owned(), json!(std::mem::take(&mut dropped)));
                output::json_text(&Value::Object(object))
            })
            .collect();
        self.left -= shown as u64;
        // One write a batch keeps up with every tick of a fast loop.
        output::exact(&lines?.join("\n"))
    }
}

fn state_text(state: &StateEvent) -> String {
    match &state.fault {
        Some(fault) => format!("state  {}: {fault}", state.state),
        None => format!("state  {}", state.state),
    }
}

/// The heading of the table. That of two axes has no room for speeds.
const fn header(axes: u8) -> &'static str {
    match axes {
        2 => {
            "      tick       t s  state        contact    device x mm   device y mm    block x mm    block y mm \
             force x N force y N"
        }
        _ => "      tick       t s  state        contact    device mm    block mm device m/s block m/s   force N",
    }
}

/// The row of a sample.
fn row(sample: &Sample, y: Option<&SampleY>) -> String {
    let when = format!(
        "{:>10} {:>9.3}  {:<12} {:<8}",
        sample.tick,
        sample.t_s,
        sample.state,
        condition::contact(sample.contact)
    );
    let (device_mm, block_mm) = (sample.device_position_m * 1e3, sample.block_position_m * 1e3);
    match y {
        None => format!(
            "{when} {device_mm:>11.3} {block_mm:>11.3} {:>10.4} {:>9.4} {:>9.3}",
            sample.device_velocity_mps, sample.block_velocity_mps, sample.command_force_n
        ),
        Some(y) => format!(
            "{when} {device_mm:>13.3} {:>13.3} {block_mm:>13.3} {:>13.3} {:>9.3} {:>9.3}",
            y.device_position_m * 1e3,
            y.block_position_m * 1e3,
            sample.command_force_n,
            y.command_force_n
        ),
    }
}

/// An entry in the local time, with its changes indented below it.
pub(crate) fn text(entry: &JournalEntry) -> String {
    text_in(entry, &TimeZone::system())
}

fn text_in(entry: &JournalEntry, zone: &TimeZone) -> String {
    let time = output::moment(entry.time_unix_s, zone).map_or_else(
        || format!("{} s", entry.time_unix_s),
        |time| time.strftime("%Y-%m-%d %H:%M:%S%.3f").to_string(),
    );
    format!("{time}  {entry}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Directional;
    use haptic_ipc::{Difference, Peer, Value};

    #[test]
    fn table_has_a_heading_above_each_number() {
        for (axes, y) in [(1, None), (2, Some(SampleY::default()))] {
            let (header, row) = (header(axes), row(&Sample::default(), y.as_ref()));
            // Numbers end where their headings do.
            let ends = |text: &str| text.trim_end().len();
            assert_eq!(ends(header), ends(&row), "{header}\n{row}");
        }
    }

    #[test]
    fn an_entry_says_who_what_and_when() {
        let entry = JournalEntry {
            seq: 3,
            time_unix_s: 1.7e9,
            tick: Some(42),
            by: Some(Peer {
                session: "1-1".into(),
                uid: 1000,
                user: Some("ada".into()),
                pid: Some(7),
                program: Some("haptic-ctl".into()),
            }),
            revision: 9,
            changes: vec![Difference {
                param: "mass".into(),
                unit: Some("kg".into()),
                before: Some(Value::Number(Directional::both(0.5))),
                after: Some(Value::Number(Directional::both(1.5))),
            }],
            ramp_ms: Some(50.0),
            ..JournalEntry::of("set")
        };
        let zone = TimeZone::fixed(jiff::tz::offset(2));
        assert_eq!(
            text_in(&entry, &zone),
            "2023-11-15 00:13:20.000  ada (haptic-ctl, process 7)  set  tick 42  revision 9  over 50 ms\n    mass: \
             0.5 kg -> 1.5 kg"
        );
    }
}
