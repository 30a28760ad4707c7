//! What every change of the scene shares: its options and its answer.

use crate::daemon::Daemon;
use crate::duration::{duration, milliseconds};
use crate::failure::Failure;
use crate::known_advice::KnownAdvice;
use crate::{output, schedule};
use clap::Args;
use haptic_core::ParameterKey;
use haptic_ipc::quantity::readable;
use haptic_ipc::{ChangeOptions, ChangeReply, Request};
use std::time::Duration;

/// The options of every change.
#[derive(Clone, Debug, Args)]
pub(crate) struct ChangeArguments {
    /// Refuse unless N is the newest revision, so that no other client's change is lost
    #[arg(long, value_name = "N")]
    if_revision: Option<u64>,

    /// Ramp to the change over TIME, at most 10s [default: 0s]
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    ramp: Option<Duration>,

    /// Show the change and its advice, and change nothing
    #[arg(long)]
    dry_run: bool,

    /// Change in this very tick, which must lie ahead, and wait for it; an interrupt takes it back
    #[arg(long, value_name = "N")]
    at_tick: Option<u64>,

    /// Change once, though the rig would chatter
    #[arg(long)]
    anyway: bool,
}

impl ChangeArguments {
    /// The options as the protocol has them.
    pub(crate) fn options(&self) -> ChangeOptions {
        ChangeOptions {
            if_revision: self.if_revision,
            ramp_ms: self.ramp.map(milliseconds),
            dry_run: self.dry_run,
            at_tick: self.at_tick,
            anyway: self.anyway,
        }
    }
}

/// What of the change is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChangeView {
    /// The values that were set.
    Applied,
    /// In what the scene differs from the one before.
    Differences,
}

/// A change that is about to be asked for.
pub(crate) struct Change {
    shown: ChangeView,
    json: bool,
    known: KnownAdvice,
}

impl Change {
    /// Call it before a change is asked for: the journal reports one with a tick.
    pub(crate) async fn prepare(
        daemon: &mut Daemon,
        request: &Request,
        shown: ChangeView,
        json: bool,
    ) -> Result<Self, Failure> {
        match request {
            Request::Set { options, .. } | Request::SceneLoad { options, .. } if options.at_tick.is_some() => {
                schedule::subscribe(daemon).await?;
            }
            _ => {}
        }
        let known = KnownAdvice::before_change(daemon, json).await?;
        Ok(Self { shown, json, known })
    }

    /// Shows the answer to a change, and waits for its tick if it has one: it ends with its client.
    pub(crate) async fn finish(self, daemon: &mut Daemon, reply: &ChangeReply) -> Result<(), Failure> {
        self.show(reply)?;
        match reply.at_tick {
            Some(_) => schedule::until_rendered(daemon, reply.revision, self.json).await,
            None => Ok(()),
        }
    }

    fn show(&self, reply: &ChangeReply) -> Result<(), Failure> {
        if self.json {
            return output::json(reply);
        }
        // What was only tried is what was asked for.
        let print = if reply.dry_run {
            output::line
        } else {
            output::unless_quiet
        };
        print(&head(reply, self.shown))?;
        let changed: Vec<&str> = match self.shown {
            ChangeView::Applied => reply.applied.keys().map(String::as_str).collect(),
            ChangeView::Differences => reply.changes.iter().map(|change| change.param.as_str()).collect(),
        };
        if self.shown == ChangeView::Differences {
            for difference in &reply.changes {
                print(&format!("  {difference}"))?;
            }
        }
        self.known.print_news(&reply.advice, &changed)
    }
}

/// What became of a change, in a line.
fn head(reply: &ChangeReply, shown: ChangeView) -> String {
    let revision = reply.revision;
    let mut head = match (reply.tick, reply.at_tick) {
        (Some(tick), _) => format!("revision {revision} from tick {tick}"),
        (None, Some(tick)) => format!("scheduled, revision {revision} for tick {tick}"),
        (None, None) if reply.dry_run => format!("only tried, revision {revision} stays"),
        (None, None) => format!("nothing changes, revision {revision} stays"),
    };
    if let Some(ends) = reply.ramp_ends_tick {
        head.push_str(&format!(", ramping until tick {ends}"));
    }
    if shown == ChangeView::Applied {
        let applied: Vec<String> = reply
            .applied
            .iter()
            .map(|(name, value)| assignment(name, *value))
            .collect();
        head.push_str(&format!(": {}", applied.join(", ")));
    } else if reply.changes.is_empty() {
        head.push_str(": nothing differs");
    }
    head
}

fn assignment(name: &str, value: f64) -> String {
    let unit = name.parse::<ParameterKey>().map_or("", |key| key.parameter.info().unit);
    format!("{name} = {} {unit}", readable(value))
}

pub(crate) fn undo(change: &ChangeArguments) -> Request {
    Request::Undo {
        options: change.options(),
    }
}

pub(crate) fn redo(change: &ChangeArguments) -> Request {
    Request::Redo {
        options: change.options(),
    }
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let change = Change::prepare(daemon, &request, ChangeView::Differences, json).await?;
    let reply: ChangeReply = daemon.ask(request).await?;
    change.finish(daemon, &reply).await
}
