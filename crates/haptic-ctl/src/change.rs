//! What every change of the scene shares: its options and its answer.

use crate::duration::{duration, milliseconds};
use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_core::ParameterKey;
use haptic_ipc::{ChangeOptions, ChangeReply};
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
}

impl ChangeArguments {
    /// The options as the protocol has them.
    pub(crate) fn options(&self) -> ChangeOptions {
        ChangeOptions {
            if_revision: self.if_revision,
            ramp_ms: self.ramp.map(milliseconds),
            dry_run: self.dry_run,
            at_tick: None,
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

pub(crate) fn show(reply: &ChangeReply, shown: ChangeView, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
    let mut head = match reply.tick {
        Some(tick) => format!("revision {} from tick {tick}", reply.revision),
        None => format!("only tried, revision {} stays", reply.revision),
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
