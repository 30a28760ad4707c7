//! `engage`, `release`, `stop`, `reset`: what moves the rig from state to state.

use crate::condition::Condition;
use crate::daemon::Daemon;
use crate::duration::duration;
use crate::failure::Failure;
use crate::{all, output, stop, wait};
use haptic_ipc::{ClientError, Request, RigState, StateReply, Status, socket_path};
use std::path::Path;
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

/// Time without an answer to a stop after which a person is told what to do.
const STOP_ALARM: Duration = Duration::from_millis(300);
/// Time after a refusal for want of room.
const ASK_AGAIN: Duration = Duration::from_millis(5);
/// Time without an answer to a stop after which nobody waits any more.
const STOP_TIMEOUT: Duration = Duration::from_secs(2);

/// Time in which the daemon has faulted a rig whose motor is on after a release: 100 ms, and its way here.
const CONFIRMATION_TIME: Duration = Duration::from_millis(150);

/// Stops the rig. Whatever keeps the daemon from saying that it has, the answer to that is not to
/// start one.
pub(crate) async fn stop(socket: Option<&Path>, request: Request, json: bool) -> Result<(), Failure> {
    let reply = ask_to_stop(socket, request, if json { None } else { Some("") }).await?;
    if json {
        return show(&reply, json);
    }
    let socket = socket_path::for_client(socket);
    let device = all::device_of(&socket).await;
    stop::show(
        &format!("{} at tick {}", reply.state, reply.tick),
        device.as_deref(),
        &socket,
    )
}

/// Asks a rig to stop. Where there is a prefix, a warning that begins with it says meanwhile what to do.
///
/// # Errors
/// The daemon refuses, or cannot be asked in time.
pub(crate) async fn ask_to_stop(
    socket: Option<&Path>,
    request: Request,
    prefix: Option<&str>,
) -> Result<StateReply, Failure> {
    // Where a crowd takes all places, a newcomer is heard for a moment, and may come again.
    let asked = async {
        loop {
            match Daemon::ask_at_once::<StateReply>(socket, request.clone()).await {
                Err(failure) if failure.is_for_want_of_room() => tokio::time::sleep(ASK_AGAIN).await,
                answered => return answered,
            }
        }
    };
    tokio::pin!(asked);
    let answered = match tokio::time::timeout(STOP_ALARM, &mut asked).await {
        Ok(answered) => answered,
        Err(_) => {
            if let Some(prefix) = prefix {
                eprintln!("haptic-ctl: {prefix}no answer yet: if the motor pulls, cut its power");
            }
            tokio::time::timeout(STOP_TIMEOUT - STOP_ALARM, asked)
                .await
                .unwrap_or(Err(Failure::NoAnswer(STOP_TIMEOUT)))
        }
    };
    answered.map_err(|failure| match failure {
        Failure::Client(ClientError::Refused(_)) => failure,
        _ => Failure::CannotStop(Box::new(failure)),
    })
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
    waiting: &WaitArguments,
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

/// Waits for as long as a device has to say that its motor is off.
///
/// # Errors
/// It has not, and the rig is faulted.
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
    output::unless_quiet(&format!("{} at tick {}", reply.state, reply.tick))
}
