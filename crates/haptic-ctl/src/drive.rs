//! `engage`, `release`, `reset`: what moves the rig from state to state; `reload`: what bounds its force meanwhile.

use crate::condition::Condition;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::units::duration;
use crate::{output, wait};
use haptic_ipc::{ReloadReply, Request, RigState, StateReply, Status, quoted};
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub(crate) struct WaitArguments {
    /// Wait for the end of the ramp
    #[arg(long)]
    wait: bool,

    /// Timeout of --wait
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5s", requires = "wait", allow_hyphen_values = true)]
    timeout: Duration,
}

#[derive(Debug, clap::Args)]
pub(crate) struct EngageArguments {
    /// Confirm that the device is the commissioned rig, until it is reconnected
    #[arg(long)]
    same_rig: bool,

    /// Engage once, though the rig would chatter
    #[arg(long)]
    anyway: bool,

    #[command(flatten)]
    waiting: WaitArguments,
}

impl EngageArguments {
    pub(crate) fn request(&self) -> Request {
        Request::Engage { anyway: self.anyway }
    }
}

pub(crate) const RELOAD_HELP: &str = "\
Only limits take effect, and none if the file has a wrong value. Options that need a restart, and files of the \
library that hold no scene, are named.

A SIGHUP to a daemon without a terminal does the same, as does `systemctl reload hapticd`.";

/// Time in which the daemon has faulted a rig whose motor is on after a release: 100 ms, and the message's delay.
const CONFIRMATION_TIME: Duration = Duration::from_millis(150);

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: StateReply = daemon.ask(request).await?;
    show(&reply, json)
}

/// The same, and until the state at the end of the ramp if that is wanted.
pub(crate) async fn run_to(
    daemon: &mut Daemon,
    request: Request,
    end: RigState,
    waiting: &WaitArguments,
    json: bool,
) -> Result<(), Failure> {
    if !waiting.wait {
        return run(daemon, request, json).await;
    }
    let reply: StateReply = daemon.ask(request).await?;
    // The first event is the state as it is by now.
    let condition = Condition::in_state(end);
    wait::subscribe(daemon, &condition).await?;
    let known = wait::until(daemon, &condition, Some(waiting.timeout)).await?;
    if end == RigState::Idle {
        stays_off(daemon).await?;
    }
    show(
        &StateReply {
            state: end,
            tick: known.tick().unwrap_or(reply.tick),
        },
        json,
    )
}

pub(crate) async fn engage(daemon: &mut Daemon, arguments: &EngageArguments, json: bool) -> Result<(), Failure> {
    if arguments.same_rig {
        let _: StateReply = daemon.ask(Request::CommissionConfirm {}).await?;
    }
    run_to(daemon, arguments.request(), RigState::Engaged, &arguments.waiting, json).await
}

/// Waits for as long as a device has to say that its motor is off.
async fn stays_off(daemon: &mut Daemon) -> Result<(), Failure> {
    tokio::time::sleep(CONFIRMATION_TIME).await;
    let status: Status = daemon.ask(Request::Status {}).await?;
    match status.fault {
        Some(fault) if status.state == RigState::Faulted => {
            Err(Failure::Halted(format!("the rig is faulted: {fault}")))
        }
        _ => Ok(()),
    }
}

fn show(reply: &StateReply, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
    let missing = match reply.state {
        RigState::Disconnected => ": no device is there; `haptic-ctl status` says why",
        _ => "",
    };
    output::unless_quiet(&format!("{} at tick {}{missing}", reply.state, reply.tick))
}

pub(crate) async fn reload(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: ReloadReply = daemon.ask(request).await?;
    if json {
        return output::json(&reply);
    }
    output::unless_quiet(&reply.to_string().replace("; ", "\n"))?;
    match &reply.changed_scene {
        Some(name) => output::unless_quiet(&format!("to feel it: `haptic-ctl scene load {}`", quoted(name))),
        None => Ok(()),
    }
}
