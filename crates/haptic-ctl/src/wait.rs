//! `wait`: until a condition holds. The daemon sends every change; nothing is polled.

use crate::condition::{self, Condition, Observations};
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::units::duration;
use crate::{complete, output, progress, stop};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Event, Request, SubscribeReply, Timing, Topic};
use std::time::{Duration, Instant};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Condition, as in 'state=engaged and device_position_m>0.01'
    #[arg(long, value_name = "CONDITION", add = ArgValueCompleter::new(complete::conditions))]
    until: Condition,

    /// Timeout, as in 5s; 0s checks once [default: none]
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    timeout: Option<Duration>,
}

pub(crate) fn help() -> String {
    format!(
        "Fields: {}; and the parameters of the scene by name or symbol. Numbers may have units \
         (device_position_m>1cm). A contact is a \
         number or one of {}. A parameter is that of the newest change, also while a ramp leads to it: \
         `set --ramp TIME --wait` ends with the ramp. Quote a word with spaces.\n\n\
         Example:\n  haptic-ctl wait --until 'state=engaged and device_position_m>1cm' --timeout 5s",
        condition::fields(),
        condition::words("contact").join(", ")
    )
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

/// Waits for a tick, however long.
pub(crate) async fn until_tick(daemon: &mut Daemon, tick: u64) -> Result<(), Failure> {
    let condition: Condition = format!("tick>={tick}").parse().map_err(Failure::Usage)?;
    subscribe(daemon, &condition).await?;
    until(daemon, &condition, None).await?;
    Ok(())
}

/// Subscribes to what the condition needs. From here on nothing is missed.
pub(crate) async fn subscribe(daemon: &mut Daemon, condition: &Condition) -> Result<(), Failure> {
    // Every tick: a condition that holds for one tick is not missed.
    let subscribed: SubscribeReply = daemon.ask(Request::subscribe(condition.topics())).await?;
    condition.check_axes(subscribed.axes()).map_err(Failure::Usage)
}

/// Waits until a condition that was subscribed to holds. The timeout runs from when all of its
/// fields are known, so that a condition that holds already needs no time.
pub(crate) async fn until(
    daemon: &mut Daemon,
    condition: &Condition,
    timeout: Option<Duration>,
) -> Result<Observations, Failure> {
    let bar = progress::busy(format!("waiting for {condition}"));
    let ended = wait(daemon, condition, timeout).await;
    bar.finish_and_clear();
    ended
}

async fn wait(daemon: &mut Daemon, condition: &Condition, timeout: Option<Duration>) -> Result<Observations, Failure> {
    let mut known = Observations::default();
    if condition.topics().contains(&Topic::Timing) {
        // Sent once a second only.
        let timing: Timing = daemon.ask(Request::Timing {}).await?;
        known.take(Event::Timing(Box::new(timing)), condition);
    }
    while !known.is_enough_for(condition) {
        if holds(&mut known, daemon.regular_event().await?, condition)? {
            return Ok(known);
        }
    }
    let waiting = async {
        while !holds(&mut known, daemon.next_event().await?, condition)? {}
        Ok::<(), Failure>(())
    };
    match timeout {
        None => waiting.await?,
        Some(timeout) => match tokio::time::timeout(timeout, waiting).await {
            Ok(ended) => ended?,
            Err(_) => {
                let found = match &known.state {
                    _ if !daemon.answers_within(stop::ALARM).await => {
                        "; the daemon does not answer: if the motor pulls, cut its power".to_owned()
                    }
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

/// Whether the condition holds after an event.
fn holds(known: &mut Observations, event: Event, condition: &Condition) -> Result<bool, Failure> {
    if known.take(event, condition) {
        return Ok(true);
    }
    if let Some(state) = known.halt(condition) {
        let why = state
            .fault
            .as_ref()
            .map_or_else(String::new, |fault| format!(" ({fault})"));
        return Err(Failure::Halted(format!(
            "the rig is {}{why}, and `{condition}` was waited for; `haptic-ctl reset` clears that",
            state.state
        )));
    }
    Ok(false)
}
