//! hapticd: a pinned thread that renders a block on a surface, and the control plane that commands
//! it.
//!
//! ```text
//! haptic-ctl, haptic-gui <-- Unix socket --> control/ --- newest scene, commands, stop --> rt/
//! <--> device
//!                                               ^                                          |
//!                                               +--- telemetry/ <---- ring of records -----+
//! ```

mod config;
mod control;
mod demo;
mod late_log;
mod log;
mod metrics;
mod preparation;
mod processor_share;
mod rt;
mod self_test;
mod service;
mod shutdown;
mod telemetry;
mod threads;
mod timers;

use clap::CommandFactory;
use config::{Config, ConfigError, Options};
use control::RigHandle;
use control::server::Server;
use control::socket::SocketError;
use device_io::link::Keeper;
use haptic_core::SceneError;
use haptic_core::servo::Command;
use haptic_ipc::Problem;
use log::say;
use metrics::MetricsError;
use preparation::{ReadyTick, prepare};
use rt::privileges;
use rt::thread::{End, FinalZero, RunningLoop};
use service::ServiceManager;
use shutdown::BlockedSignals;
use std::io::Write;
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;
use telemetry::feed::PUMP_PERIOD;
use thiserror::Error;

/// Why the daemon ended.
#[derive(Debug, Error)]
enum Failure {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Socket(#[from] SocketError),
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    #[error("{0}")]
    System(#[from] std::io::Error),
    #[error("the real-time thread {0}")]
    RealTime(String),
}

fn main() -> ExitCode {
    let options = Options::of_command_line();
    if options.manual_page {
        // It has the whole help.
        let command = Options::command().mut_args(|option| option.hide_short_help(false));
        let page = clap_mangen::Man::new(command).section("8");
        return page
            .render(&mut std::io::stdout())
            .map_or(ExitCode::FAILURE, |()| ExitCode::SUCCESS);
    }
    if options.print_device {
        return match options.device() {
            Ok(device) => writeln!(std::io::stdout(), "{device}").map_or(ExitCode::FAILURE, |()| ExitCode::SUCCESS),
            Err(error) => {
                eprintln!("hapticd: {error}");
                ExitCode::from(2)
            }
        };
    }
    if let Err(error) = log::start() {
        eprintln!("hapticd: {error}");
        return ExitCode::FAILURE;
    }
    let _last_lines = LastLines;
    let (demo, self_test, ends_with_input) = (options.demo, options.self_test, options.end_with_input);
    let done = options
        .resolve()
        .map_err(Failure::from)
        .and_then(|config| match self_test {
            Some(turn_s) => run_self_test(config, Duration::from_secs(turn_s)),
            None => run(config, demo, ends_with_input),
        });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            log::say_last(&failure.to_string(), LastLines::TIME);
            // 2: the configuration is invalid; 1: a failure at run time.
            ExitCode::from(if matches!(failure, Failure::Config(_)) { 2 } else { 1 })
        }
    }
}

fn run(config: Config, demo: bool, ends_with_input: bool) -> Result<(), Failure> {
    rt::thread::keep_panics();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let local = tokio::task::LocalSet::new();
    let ended = local.block_on(&runtime, async move {
        // First, because a second daemon must not touch the rig.
        let server = Server::bind(
            &config.socket,
            config.socket_group.clone(),
            config.watch_socket.as_deref(),
        )?;
        let monitoring = config.metrics.clone();
        let metrics = match monitoring.address {
            Some(address) => Some(metrics::Server::bind(address).await?),
            None => None,
        };
        let stop_signals = BlockedSignals::new()?;
        let ramp = Duration::from_secs_f64(config.servo.ramp_s);
        let (mut running, rig) = start_loop(config)?;
        let rig = Rc::new(rig);
        let (stop_signals, reloads) = stop_signals.watch(ramp, rig.channel.end_of_loop())?;
        if ends_with_input {
            shutdown::end_with_input()?;
        }
        let manager = ServiceManager::of_process()?;
        if let Some(address) = metrics.as_ref().and_then(metrics::Server::address) {
            say(&format!("metrics at http://{address}/metrics"));
        }
        introduce(&rig, &server);
        if demo {
            // The status line shows no reason.
            if let Err(error) = rig.engage_because("the demo begins").await {
                say(&error.message);
            }
        }
        tokio::select! {
            () = server.serve(Rc::clone(&rig)) => {}
            () = pump(&rig) => {}
            () = control::lease::watch(&rig) => {}
            () = control::known_rig::watch(&rig) => {}
            () = manager.watch(&rig) => {}
            () = control::reload::on_signal(&rig, &manager, reloads) => {}
            () = scraped(metrics.as_ref(), &rig) => {}
            () = metrics::keep(monitoring.file.clone(), &rig) => {}
            () = running.ended() => {}
            () = demo::show_status(Rc::clone(&rig)), if demo => {}
            // The demo's status line shows the same.
            () = late_log::watch(&rig.channel, server.path()), if !demo => {}
            () = stop_signals.wait() => {}
        }
        stop_signals.begun();
        manager.stopping();
        // The socket is served to the end: a client may want to stop the rig until the force is
        // gone.
        rig.channel.close();
        tokio::select! {
            () = server.serve(Rc::clone(&rig)) => {}
            () = pump(&rig) => {}
            () = running.ended() => {}
            () = stop_signals.wait() => {}
            _ = tokio::time::timeout(ramp + RELEASE_GRACE, release(&rig)) => {}
        }
        let end = running.end();
        metrics::remove(monitoring.file).await;
        if demo {
            log::show(format!("\nhapticd: {}\n", demo::status_line(&rig)));
        }
        judge(end)
    });
    // Without waiting for its threads: one may be blocked by a disk.
    runtime.shutdown_background();
    ended
}

/// Judges how the loop ended.
///
/// # Errors
/// The loop hangs or has failed, or a device may still have force.
fn judge(end: Option<End>) -> Result<(), Failure> {
    let Some(End { panic, final_zero }) = end else {
        return Err(Failure::RealTime("hangs: cut the power of the motor".to_owned()));
    };
    let ended = match panic {
        Some(message) => format!("failed at {message}"),
        // A device that was unplugged before has no force.
        None if final_zero != FinalZero::Unconfirmed => return Ok(()),
        None => "ended".to_owned(),
    };
    let zero = match final_zero {
        FinalZero::Confirmed => "its force was set to zero",
        FinalZero::Unconfirmed => "the device has not confirmed the zero force: cut the power of the motor",
        FinalZero::NoDevice => {
            "no device was connected to take the zero force: if the motor still pulls, cut its power"
        }
    };
    Err(Failure::RealTime(format!("{ended}; {zero}")))
}

/// Time for the last answers to be sent.
const LAST_ANSWERS_TIME: Duration = Duration::from_millis(50);

/// Time that the release at the end may take beyond its ramp.
const RELEASE_GRACE: Duration = Duration::from_millis(800);

/// Writes the last log lines before the end of the process, also after a panic.
struct LastLines;

impl LastLines {
    /// Time that this may take.
    const TIME: Duration = Duration::from_millis(700);
}

impl Drop for LastLines {
    fn drop(&mut self) {
        log::flush(Self::TIME);
    }
}

/// Starts the real-time thread; returns it and the control thread's handle to the rig.
fn start_loop(config: Config) -> Result<(RunningLoop, RigHandle), Failure> {
    let mut prepared = prepare(config)?;
    let (shared, settings, status) = (Arc::clone(&prepared.control.shared), prepared.settings, prepared.status);
    let (running, status) = match prepared.tick {
        ReadyTick::Line(tick) => rt::thread::start(tick, shared, settings, status),
        ReadyTick::Plane(tick) => rt::thread::start(tick, shared, settings, status),
    }?;
    if let Some(cpu) = prepared.settings.cpu {
        privileges::leave_cpu_alone(cpu, &prepared.cpus);
    }
    // After that, so that the keeper's thread avoids the loop's processor as well.
    prepared.facts.keeper = prepared.keeper.map(Keeper::start).transpose()?;
    prepared.facts.real_time = status;
    let rig = RigHandle::new(prepared.facts, prepared.control, prepared.scene);
    Ok((running, rig))
}

/// Measures the loop beside a bare one, without clients.
fn run_self_test(config: Config, turn: Duration) -> Result<(), Failure> {
    let mut prepared = prepare(config)?;
    // Engaged, as in use: the ring is empty.
    prepared.control.inbox.command(1, Command::Engage, 0);
    let serving = prepared.control.serve(prepared.settings.cpu, prepared.cpus)?;
    let period_ns = prepared.settings.period_ns;
    let ReadyTick::Line(mut tick) = prepared.tick else {
        unreachable!("the configuration refuses a self-test of two axes");
    };
    let measure =
        move |waiting| self_test::compare(&mut tick, serving, turn, period_ns, waiting).report(period_ns, waiting);
    let (report, status) = rt::thread::on_prepared_thread(prepared.settings, prepared.status, measure)?;
    for problem in &status.problems {
        say_problem(problem);
    }
    writeln!(std::io::stdout().lock(), "{report}")?;
    Ok(())
}

fn say_problem(problem: &Problem) {
    say(&format!("{}\n         to fix it: {}", problem.what, problem.remedy));
}

/// Logs what runs, where, and with which problems.
fn introduce(rig: &RigHandle, server: &Server) {
    let facts = &rig.facts;
    let real_time = facts.real_time();
    say(&facts.device);
    say(&format!("control socket {}", server.path().display()));
    if let Some(path) = server.watch_path() {
        say(&format!("watchers' socket {}", path.display()));
    }
    for problem in server.problems() {
        say_problem(&problem);
    }
    say(&format!(
        "{:.0} Hz, {}, {}, {}",
        1.0 / facts.period_s(),
        real_time.scheduling(),
        real_time.place(),
        real_time.memory()
    ));
    for problem in &real_time.problems {
        say_problem(problem);
    }
}

/// Serves metrics for ever, where they are asked for.
async fn scraped(metrics: Option<&metrics::Server>, rig: &Rc<RigHandle>) {
    match metrics {
        Some(server) => server.serve(Rc::clone(rig)).await,
        None => std::future::pending().await,
    }
}

async fn pump(rig: &RigHandle) {
    let mut pause = timers::every(PUMP_PERIOD);
    loop {
        pause.tick().await;
        rig.channel.heartbeat();
        rig.pump();
    }
}

/// Releases the rig along its ramp, before the end.
async fn release(rig: &RigHandle) {
    // A rig that is stopped or faulted refuses, and has no force.
    if rig.release_because("the daemon ends").await.is_err() {
        return;
    }
    while rig.channel.state().is_live() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    // A client that has stopped the rig meanwhile still gets its answer.
    tokio::time::sleep(LAST_ANSWERS_TIME).await;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_judged_by_what_the_device_has_taken() {
        let judged = |final_zero| {
            let end = End {
                panic: None,
                final_zero,
            };
            judge(Some(end)).map_err(|failure| failure.to_string())
        };
        assert_eq!(judged(FinalZero::Confirmed), Ok(()));
        assert_eq!(judged(FinalZero::NoDevice), Ok(()), "it was unplugged before");
        let message = judged(FinalZero::Unconfirmed).expect_err("there may still be a force");
        assert!(
            message.contains("has not confirmed the zero force: cut the power"),
            "{message}"
        );
        let hangs = judge(None).expect_err("nobody knows").to_string();
        assert!(hangs.contains("hangs: cut the power"), "{hangs}");
    }
}
