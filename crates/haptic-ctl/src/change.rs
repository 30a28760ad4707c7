//! What every change of the scene shares: its options and its answer.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::scene::reference;
use crate::units::duration;
use crate::{output, schedule, wait};
use clap::Args;
use haptic_core::ParameterKey;
use haptic_ipc::quantity::readable;
use haptic_ipc::{Advice, ChangeOptions, ChangeReply, Request};
use std::time::Duration;

/// The options of every change.
#[derive(Clone, Debug, Args)]
pub(crate) struct ChangeArguments {
    /// Refuse unless N is the newest revision
    #[arg(long, value_name = "N")]
    if_revision: Option<u64>,

    /// Duration of the change, at most 10s [default: 0s]
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    ramp: Option<Duration>,

    /// Wait until the ramp has ended
    #[arg(long, requires = "ramp")]
    pub(crate) wait: bool,

    /// Show the change and its advice, and change nothing
    #[arg(long)]
    dry_run: bool,

    /// Change in the coming tick N, and wait; an interrupt cancels it
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
            ramp_ms: self.ramp.map(|ramp| ramp.as_secs_f64() * 1e3),
            dry_run: self.dry_run,
            at_tick: self.at_tick,
            anyway: self.anyway,
        }
    }
}

/// Asks for a change and shows the answer; waits for its tick if it has one, since it ends with its client, and where
/// that is wanted for the end of its ramp.
pub(crate) async fn run(daemon: &mut Daemon, request: Request, waits: bool, json: bool) -> Result<(), Failure> {
    match &request {
        // Before it is asked for: the journal reports one with a tick.
        Request::Set { options, .. } | Request::SceneLoad { options, .. } if options.at_tick.is_some() => {
            schedule::subscribe(daemon).await?;
        }
        _ => {}
    }
    let is_set = matches!(request, Request::Set { .. });
    let reply: ChangeReply = reference::ask(daemon, request).await?;
    if json {
        output::json(&reply)?;
    } else {
        show(&reply, is_set)?;
    }
    if reply.at_tick.is_some() {
        schedule::until_rendered(daemon, reply.revision, json).await?;
    }
    match reply.ramp_ends_tick.filter(|_| waits) {
        Some(last) => wait::until_tick(daemon, last).await,
        None => Ok(()),
    }
}

/// Shows the values that were set, or in what the scene differs from the one before; and the advice on the scene.
fn show(reply: &ChangeReply, is_set: bool) -> Result<(), Failure> {
    // What was only tried is what was asked for.
    let print = if reply.dry_run {
        output::line
    } else {
        output::unless_quiet
    };
    print(&head(reply, is_set))?;
    if !is_set {
        for difference in &reply.changes {
            print(&format!("  {difference}"))?;
        }
    }
    notes(&reply.advice)
}

pub(crate) fn notes(advice: &[Advice]) -> Result<(), Failure> {
    advice
        .iter()
        .try_for_each(|advice| output::unless_quiet(&format!("note: {}", advice.message)))
}

/// What became of a change, in a line.
fn head(reply: &ChangeReply, is_set: bool) -> String {
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
    if is_set {
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
