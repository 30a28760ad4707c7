//! `schedule`: changes of the scene in ticks to come.
//!
//! Scheduled changes end with their client, so it stays until the last one is rendered.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{change, output};
use haptic_ipc::{
    ClientError, Envelope, ErrorCode, Event, JournalEntry, Request, ScheduleCancelReply, ScheduleReply, SubscribeReply,
    Topic, WireError, regular_file,
};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = r#"The file is JSON: a list of changes, as in
  [{"at_tick":5000,"params":{"Fs":5}},
   {"at_tick":5500,"params":{"Fs":{"plus":0.5}},"ramp_ms":50},
   {"at_tick":6000,"scene":"viscous-drag"}]
or an object with that list as `changes`, and the fields of `schedule` in docs/control.md.
haptic-ctl waits until the last change is rendered; an interrupt cancels those that wait.

Example:
  haptic-ctl schedule steps.json --name staircase"#;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Arguments {
    /// File of the changes; `-` for standard input
    #[arg(required = true)]
    file: Option<PathBuf>,

    /// Name of the schedule [default: that in the file]
    #[arg(long)]
    name: Option<String>,

    /// Return at once, and leave the schedule
    #[arg(long)]
    keep: bool,

    /// Change once, though the rig would chatter
    #[arg(long)]
    anyway: bool,

    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Cancel a schedule and those after it
    Cancel {
        /// Name of the schedule [default: all]
        name: Option<String>,
    },
}

impl Arguments {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        if let Some(Command::Cancel { name }) = &self.command {
            return Ok(Request::ScheduleCancel { name: name.clone() });
        }
        let path = self.file.as_deref().unwrap_or(Path::new("-"));
        let refused = |error: &dyn std::fmt::Display| Failure::Usage(format!("{}: {error}", path.display()));
        let text = read(path).map_err(|error| refused(&error))?;
        let mut line = match serde_json::from_str(&text).map_err(|error| refused(&error))? {
            Value::Object(line) => line,
            changes => [("changes".to_owned(), changes)].into_iter().collect(),
        };
        line.extend([("id".to_owned(), json!(1)), ("op".to_owned(), json!("schedule"))]);
        line.extend(self.name.clone().map(|name| ("name".to_owned(), json!(name))));
        if self.keep {
            line.insert("keep".to_owned(), json!(true));
        }
        if self.anyway {
            line.insert("anyway".to_owned(), json!(true));
        }
        let line = Value::Object(line).to_string();
        Envelope::parse(&line)
            .map(|envelope| envelope.request)
            .map_err(|bad| refused(&bad.error.message))
    }
}

fn read(path: &Path) -> std::io::Result<String> {
    if path != Path::new("-") {
        return regular_file::read_text(path);
    }
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    Ok(text)
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let Request::Schedule { keep, dry_run, .. } = request else {
        let reply: ScheduleCancelReply = daemon.ask(request).await?;
        return if json {
            output::json(&reply)
        } else {
            output::unless_quiet(&format!(
                "cancelled: {}",
                output::count(reply.cancelled as u64, "change")
            ))
        };
    };
    let stays = !keep && !dry_run;
    if stays {
        subscribe(daemon).await?;
    }
    let reply: ScheduleReply = daemon.ask(request).await?;
    show(&reply, json)?;
    match reply.changes.last() {
        Some(last) if stays => until_rendered(daemon, last.revision, json).await,
        _ => Ok(()),
    }
}

fn show(reply: &ScheduleReply, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
    let verb = if reply.dry_run { "only tried" } else { "scheduled" };
    let ticks = |index: Option<&haptic_ipc::AcceptedChange>| index.map_or(0, |change| change.at_tick);
    output::unless_quiet(&format!(
        "{verb}: {}, {} from tick {} to {}",
        reply.name,
        output::count(reply.changes.len() as u64, "change"),
        ticks(reply.changes.first()),
        ticks(reply.changes.last())
    ))?;
    change::notes(&reply.advice)
}

/// Follows the journal, before changes are scheduled.
pub(crate) async fn subscribe(daemon: &mut Daemon) -> Result<(), Failure> {
    let _: SubscribeReply = daemon.ask(Request::subscribe(vec![Topic::Log])).await?;
    Ok(())
}

/// Tells of this client's changes as they are rendered, up to the one with this revision.
pub(crate) async fn until_rendered(daemon: &mut Daemon, last_revision: u64, json: bool) -> Result<(), Failure> {
    loop {
        let Event::Log(entry) = daemon.next_event().await? else {
            continue;
        };
        if entry.op.starts_with("schedule") && entry.op != "schedule" {
            return Err(taken_back(*entry));
        }
        let is_mine = entry.by.as_ref().is_some_and(|by| by.session == daemon.hello().session);
        if !is_mine || entry.at_tick.is_none() {
            continue;
        }
        if json {
            output::json(&entry)?;
        } else if let Some(tick) = entry.tick {
            output::unless_quiet(&format!("revision {} from tick {tick}", entry.revision))?;
        }
        if entry.revision >= last_revision {
            return Ok(());
        }
    }
}

fn taken_back(entry: JournalEntry) -> Failure {
    let message = entry.message.unwrap_or_else(|| "the schedule was cancelled".to_owned());
    ClientError::Refused(WireError::new(ErrorCode::NoSuchSchedule, message)).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(text: &str, name: Option<&str>) -> Result<Request, String> {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("steps.json");
        std::fs::write(&path, text).expect("it can be written");
        let arguments = Arguments {
            file: Some(path),
            name: name.map(str::to_owned),
            keep: true,
            anyway: false,
            command: None,
        };
        arguments.request().map_err(|failure| failure.to_string())
    }

    #[test]
    fn schedule_file_is_a_list_or_object_and_errors_name_the_part() {
        let list = r#"[{"at_tick":5,"params":{"Fs":{"plus":0.5}}}]"#;
        for (text, name, expected) in [
            (list.to_owned(), Some("b"), Some("b")),
            (format!(r#"{{"name":"a","changes":{list}}}"#), None, Some("a")),
            (format!(r#"{{"name":"a","changes":{list}}}"#), Some("b"), Some("b")),
            (list.to_owned(), None, None),
        ] {
            let Ok(Request::Schedule {
                changes, name, keep, ..
            }) = request(&text, name)
            else {
                panic!("{text}");
            };
            assert_eq!((name.as_deref(), keep), (expected, true));
            assert!(matches!(&changes[..], [change] if change.at_tick == 5));
        }
        for text in ["", r#"[{"at_tick":5}]"#] {
            let error = request(text, None).expect_err(text);
            assert!(error.contains("steps.json"), "{error}");
        }
    }
}
