//! What every change of the scene has in common: how it is made, and what it is answered with.

use crate::duration::{duration, milliseconds};
use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_core::ParameterKey;
use haptic_ipc::ChangeReply;
use std::time::Duration;

/// How a change is made.
#[derive(Clone, Debug, Args)]
pub(crate) struct How {
    /// Only if this is still the newest revision, so that nobody's work is undone unawares
    #[arg(long, value_name = "N")]
    pub(crate) if_revision: Option<u64>,

    /// Go there over this time, as in 50ms or 2s, at most 10s
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    ramp: Option<Duration>,

    /// Only say what would change, and what advice there would be
    #[arg(long)]
    pub(crate) dry_run: bool,
}

impl How {
    pub(crate) fn ramp_ms(&self) -> Option<f64> {
        self.ramp.map(milliseconds)
    }
}

/// What of the change is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// The values that were set.
    Applied,
    /// In what the scene differs from the one before.
    Differences,
}

pub(crate) fn show(reply: &ChangeReply, shown: Shown, json: bool) -> Result<(), Failure> {
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
    if shown == Shown::Applied {
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
    if shown == Shown::Differences {
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
