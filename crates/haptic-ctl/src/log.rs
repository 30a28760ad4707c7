//! `log`: who changed what, and when; `events log` follows it.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{JournalEntry, LogReply, Request};
use jiff::Timestamp;
use jiff::tz::TimeZone;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Number of entries, the newest
    #[arg(short = 'n', long, value_name = "N", default_value = "20")]
    limit: usize,
}

impl Arguments {
    pub(crate) fn request(&self) -> Request {
        Request::Log {
            after: None,
            limit: Some(self.limit),
        }
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let reply: LogReply = daemon.ask(arguments.request()).await?;
    if reply.entries.is_empty() && arguments.limit > 0 && !json {
        return output::unless_quiet("nothing has been changed since the daemon began");
    }
    for entry in &reply.entries {
        if json {
            output::json(entry)?;
        } else {
            output::line(&text(entry))?;
        }
    }
    Ok(())
}

/// An entry in the local time, with its changes indented below it.
pub(crate) fn text(entry: &JournalEntry) -> String {
    text_in(entry, &TimeZone::system())
}

fn text_in(entry: &JournalEntry, zone: &TimeZone) -> String {
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
            text_in(&entry, &zone),
            "2023-11-15 00:13:20.000  ada (haptic-ctl, process 7)  set  tick 42  revision 9  over 50 ms\n    mass: \
             0.5 kg -> 1.5 kg"
        );
    }
}
