//! `wait`: until something is so. The daemon tells of every change; nothing is asked again and again.

use crate::condition::{self, Condition, Known};
use crate::daemon::Daemon;
use crate::duration::duration;
use crate::failure::Failure;
use crate::{complete, output};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Request, RigState, SubscribeReply};
use std::time::{Duration, Instant};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// What is waited for: comparisons of a field with a value by = != < <= > >=, joined by `and`, as in
    /// 'state=engaged and device_position_m>0.01'
    #[arg(long, value_name = "CONDITION", add = ArgValueCompleter::new(complete::conditions))]
    until: Condition,

    /// How long at most, as in 5s [default: for ever]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    timeout: Option<Duration>,
}

/// For the help text.
pub(crate) fn help() -> String {
    format!(
        "Fields: {}; and the parameters of the scene by name or symbol, with units where you like. A word with spaces is put in quotes.\n\n\
         Exits 5 when the time is over, and 6 when the rig is stopped or faulted while another state is waited for.",
        condition::fields()
    )
}

impl Arguments {
    pub(crate) fn request(&self) -> Request {
        subscription(&self.until)
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    subscribe(daemon, &arguments.until).await?;
    let began = Instant::now();
    let known = until(daemon, &arguments.until, arguments.timeout).await?;
    let Some(state) = &known.state else {
        return Ok(());
    };
    if json {
        return output::json(&serde_json::json!({
            "condition": arguments.until.to_string(),
            "state": state.state,
            "revision": state.revision,
            "tick": known.tick(),
            "waited_s": began.elapsed().as_secs_f64(),
        }));
    }
    output::line(&format!(
        "{}: {}, revision {}, tick {}",
        arguments.until,
        state.state,
        state.revision,
        known.tick().unwrap_or_default()
    ))
}

fn subscription(condition: &Condition) -> Request {
    // Every tick: what holds for one of them is not missed.
    Request::Subscribe {
        topics: condition.topics(),
        rate_hz: None,
        batch_ms: None,
    }
}

/// From here on nothing is missed.
pub(crate) async fn subscribe(daemon: &mut Daemon, condition: &Condition) -> Result<(), Failure> {
    let _: SubscribeReply = daemon.ask(subscription(condition)).await?;
    Ok(())
}

/// Waits until a condition that was subscribed to holds.
pub(crate) async fn until(
    daemon: &mut Daemon,
    condition: &Condition,
    timeout: Option<Duration>,
) -> Result<Known, Failure> {
    let mut known = Known::default();
    let waiting = async {
        loop {
            let event = daemon.next_event().await?;
            if known.take(event, condition) {
                return Ok(());
            }
            if let Some(state) = &known.state
                && matches!(state.state, RigState::Stopped | RigState::Faulted)
                && condition.is_ruled_out_by(state.state)
            {
                let why = state
                    .fault
                    .as_ref()
                    .map_or_else(String::new, |fault| format!(" ({fault})"));
                return Err(Failure::Halted(format!(
                    "the rig is {}{why}, and `{condition}` was waited for; `haptic-ctl reset` clears that",
                    state.state
                )));
            }
        }
    };
    match timeout {
        None => waiting.await?,
        Some(timeout) => match tokio::time::timeout(timeout, waiting).await {
            Ok(ended) => ended?,
            Err(_) => {
                let found = match &known.state {
                    Some(state) => format!("; the rig is {}, revision {}", state.state, state.revision),
                    None => String::new(),
                };
                return Err(Failure::TimedOut(format!(
                    "`{condition}` did not come about within {} s{found}",
                    timeout.as_secs_f64()
                )));
            }
        },
    }
    Ok(known)
}
