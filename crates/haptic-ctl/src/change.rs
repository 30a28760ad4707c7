//! What every change of the scene shares: its options and its answer.

use crate::daemon::Daemon;
use crate::duration::{duration, milliseconds};
use crate::failure::Failure;
use crate::{output, schedule};
use clap::Args;
use haptic_core::ParameterKey;
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
}

impl ChangeArguments {
    /// The options as the protocol has them.
    pub(crate) fn options(&self) -> ChangeOptions {
        ChangeOptions {
            if_revision: self.if_revision,
            ramp_ms: self.ramp.map(milliseconds),
            dry_run: self.dry_run,
            at_tick: self.at_tick,
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

/// To be called before a change is asked for: one with a tick is told of by the journal.
pub(crate) async fn prepare(daemon: &mut Daemon, request: &Request) -> Result<(), Failure> {
    match request {
        Request::Set { options, .. } | Request::SceneLoad { options, .. } if options.at_tick.is_some() => {
            schedule::subscribe(daemon).await
        }
        _ => Ok(()),
    }
}

/// Shows the answer to a change, and waits for its tick if it has one: it ends with its client.
pub(crate) async fn finish(
    daemon: &mut Daemon,
    reply: &ChangeReply,
    shown: ChangeView,
    json: bool,
) -> Result<(), Failure> {
    show(reply, shown, json)?;
    match reply.at_tick {
        Some(_) => schedule::until_rendered(daemon, reply.revision, json).await,
        None => Ok(()),
    }
}

pub(crate) fn show(reply: &ChangeReply, shown: ChangeView, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
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
    output::line(&head)?;
    if shown == ChangeView::Differences {
        for difference in &reply.changes {
            output::line(&format!("  {difference}"))?;
        }
    }
    for advice in &reply.advice {
        output::line(&format!("note: {}", advice.message))?;
    }
    Ok(())
}

fn assignment(name: &str, value: f64) -> String {
    let unit = name.parse::<ParameterKey>().map_or("", |key| key.parameter.info().unit);
    format!("{name} = {value} {unit}")
}
