//! `log`: who changed what, and when.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{Event, JournalEntry, LogReply, Request, SubscribeReply, Topic};
use jiff::Timestamp;
use jiff::tz::TimeZone;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Number of entries, the newest
    #[arg(short = 'n', long, value_name = "N", default_value = "20")]
    limit: usize,

    /// Follow new changes, until interrupted
    #[arg(long, short)]
    follow: bool,
}

impl Arguments {
    pub(crate) fn requests(&self) -> Vec<Request> {
        let mut requests = Vec::new();
        if self.follow {
            requests.push(Request::Subscribe {
                topics: vec![Topic::Log],
                rate_hz: None,
                batch_ms: None,
            });
        }
        requests.push(Request::Log {
            after: None,
            limit: Some(self.limit),
        });
        requests
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let mut requests = arguments.requests();
    let log = requests.pop();
    // Subscribed first: nothing falls between what was and what comes.
    for subscribe in requests {
        let _: SubscribeReply = daemon.ask(subscribe).await?;
    }
    let mut shown = 0;
    if let Some(log) = log {
        let reply: LogReply = daemon.ask(log).await?;
        for entry in &reply.entries {
            show(entry, json)?;
            shown = entry.seq;
        }
        if reply.entries.is_empty() && arguments.limit > 0 && !arguments.follow && !json {
            output::line("nothing has been changed since the daemon began")?;
        }
    }
    if !arguments.follow {
        return Ok(());
    }
    loop {
        if let Event::Log(entry) = daemon.next_event().await?
            && entry.seq > shown
        {
            show(&entry, json)?;
        }
    }
}

fn show(entry: &JournalEntry, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(entry);
    }
    output::line(&text(entry, &TimeZone::system()))
}

/// An entry, with its changes indented below it.
fn text(entry: &JournalEntry, zone: &TimeZone) -> String {
    format!("{}  {entry}", local_time(entry.time_unix_s, zone))
}

fn local_time(unix_s: f64, zone: &TimeZone) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the cast saturates, and no clock shows such a time"
    )]
    let ms = (unix_s * 1e3).round() as i64;
    Timestamp::from_millisecond(ms).map_or_else(
        |_| format!("{unix_s} s"),
        |time| {
            time.to_zoned(zone.clone())
                .strftime("%Y-%m-%d %H:%M:%S%.3f")
                .to_string()
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Directional;
    use haptic_ipc::{Difference, Peer, Value};

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
            text(&entry, &zone),
            "2023-11-15 00:13:20.000  ada (haptic-ctl, process 7)  set  tick 42  revision 9  over 50 ms\n    mass: \
             0.5 kg -> 1.5 kg"
        );
    }
}
