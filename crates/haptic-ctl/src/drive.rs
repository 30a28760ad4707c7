//! `engage`, `release`, `stop`, `reset`: what moves the rig from state to state.

use crate::condition::Condition;
use crate::daemon::Daemon;
use crate::duration::duration;
use crate::failure::Failure;
use crate::{output, wait};
use haptic_ipc::{Request, RigState, StateReply};
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub(crate) struct Waiting {
    /// Wait for the end of the ramp
    #[arg(long)]
    wait: bool,

    /// How long to wait at most
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5s", requires = "wait", allow_hyphen_values = true)]
    timeout: Duration,
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: StateReply = daemon.ask(request).await?;
    show(&reply, json)
}

/// The same, and until the state at the end of the ramp if that is wanted.
pub(crate) async fn run_to(
    daemon: &mut Daemon,
    request: Request,
    end: RigState,
    waiting: &Waiting,
    json: bool,
) -> Result<(), Failure> {
    if !waiting.wait {
        return run(daemon, request, json).await;
    }
    let reply: StateReply = daemon.ask(request).await?;
    // What is heard first is the state as it is by now.
    let condition = Condition::in_state(end);
    wait::subscribe(daemon, &condition).await?;
    let known = wait::until(daemon, &condition, Some(waiting.timeout)).await?;
    show(
        &StateReply {
            state: end,
            tick: known.tick().unwrap_or(reply.tick),
        },
        json,
    )
}

fn show(reply: &StateReply, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
    output::line(&format!("{} at tick {}", reply.state, reply.tick))
}
