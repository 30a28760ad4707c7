//! hapticd: a pinned thread that renders a block on a surface, and the control plane that steers it.
//!
//! ```text
//! haptic-ctl, haptic-gui <-- Unix socket --> control/ --- newest scene, commands, stop --> rt/ <--> device
//!                                               ^                                          |
//!                                               +--- telemetry/ <---- ring of records -----+
//! ```

mod config;
mod control;
mod demo;
mod ending;
mod late_log;
mod log;
mod processor_share;
mod rt;
mod self_test;
mod service;
mod telemetry;

use clap::Parser;
use config::{Config, ConfigError, Options, RigChoice};
use control::server::Server;
use control::socket::SocketError;
use control::{Facts, RigHandle};
use device_io::Device;
use device_io::link::{Keeper, LinkMonitor};
use ending::BlockedSignals;
use haptic_core::adviser::RigFacts;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{Command, CompiledScene, Servo, Settings};
use haptic_core::{Renderer, Scene, SceneError};
use haptic_ipc::{Problem, RealTimeStatus};
use log::{Level, say, say_at};
use processor_share::ProcessorShare;
use rt::handoff::Shared;
use rt::lateness::Lateness;
use rt::privileges;
use rt::thread::{End, FinalZero, RunningLoop};
use rt::thread_settings::{Policy, ThreadSettings};
use rt::tick::Tick;
use service::ServiceManager;
use std::io::Write;
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;
use telemetry::feed::Feed;
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
    #[error("{0}")]
    System(#[from] std::io::Error),
    #[error("the real-time thread {0}")]
    RealTime(String),
}

/// Revision of the scene that the daemon starts with.
const FIRST_REVISION: u64 = 1;

/// How often the control thread looks at the telemetry.
const PUMP_PERIOD: Duration = Duration::from_millis(5);

fn main() -> ExitCode {
    let options = Options::parse();
    if let Err(error) = log::start() {
        eprintln!("hapticd: {error}");
        return ExitCode::FAILURE;
    }
    let _last_lines = LastLines;
    let (demo, self_test) = (options.demo, options.self_test);
    let done = options
        .resolve()
        .map_err(Failure::from)
        .and_then(|config| match self_test {
            Some(turn_s) => run_self_test(config, turn_s),
            None => run(config, demo),
        });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            say_at(Level::Error, &failure.to_string());
            // What was asked cannot be done (2), or something broke while doing it (1).
            ExitCode::from(if matches!(failure, Failure::Config(_)) { 2 } else { 1 })
        }
    }
}

fn run(config: Config, demo: bool) -> Result<(), Failure> {
    rt::thread::keep_panics();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let local = tokio::task::LocalSet::new();
    let ended = local.block_on(&runtime, async move {
        // Before anything moves: a second daemon must not touch the rig.
        let server = Server::bind(
            &config.socket,
            config.socket_group.clone(),
            config.watch_socket.as_deref(),
        )?;
        let stop_signals = BlockedSignals::new()?;
        let ramp = Duration::from_secs_f64(config.ramp_s);
        let (mut running, rig) = start_loop(config)?;
        let rig = Rc::new(rig);
        let mut stop_signals = stop_signals.watch(ramp, rig.end_of_loop())?;
        let manager = ServiceManager::of_process()?;
        introduce(&rig, &server);
        if demo {
            // At the first tick nothing can forbid it; whatever else it says is in the status line.
            drop(rig.command(Command::Engage, rig.stops(), None).await);
        }
        tokio::select! {
            () = server.serve(Rc::clone(&rig)) => {}
            () = pump(&rig) => {}
            () = control::lease::watch(&rig) => {}
            () = manager.watch(&rig) => {}
            () = running.ended() => {}
            () = demo::show_status(Rc::clone(&rig)), if demo => {}
            // The demo's status line says it already.
            () = late_log::watch(&rig), if !demo => {}
            () = stop_signals.wait() => {}
        }
        stop_signals.begun();
        manager.stopping();
        // The socket is served to the end: until the force is gone, somebody may want to stop it.
        rig.close();
        tokio::select! {
            () = server.serve(Rc::clone(&rig)) => {}
            () = pump(&rig) => {}
            () = running.ended() => {}
            () = stop_signals.wait() => {}
            _ = tokio::time::timeout(ramp + RELEASE_GRACE, release(&rig)) => {}
        }
        let end = running.end();
        if demo {
            log::show(format!("\nhapticd: {}\n", demo::status_line(&rig)));
        }
        judge(end)
    });
    // Its end waits for none of its threads: one may stand on a disk that does not answer.
    runtime.shutdown_background();
    ended
}

/// What there is to say of how the loop ended.
fn judge(end: Option<End>) -> Result<(), Failure> {
    let Some(End { panic, final_zero }) = end else {
        return Err(Failure::RealTime("hangs: cut the power of the motor".to_owned()));
    };
    let ended = match panic {
        Some(message) => format!("failed at {message}"),
        // A device that was unplugged before is not missed.
        None if final_zero != FinalZero::NotTaken => return Ok(()),
        None => "ended".to_owned(),
    };
    let zero = match final_zero {
        FinalZero::Taken => "its force was set to zero",
        FinalZero::NotTaken => "the device did not take the zero force: cut the power of the motor",
        FinalZero::NoDevice => {
            "no device was connected to take the zero force: if the motor still pulls, cut its power"
        }
    };
    Err(Failure::RealTime(format!("{ended}; {zero}")))
}

/// Time for the last answers to leave.
const FAREWELL: Duration = Duration::from_millis(50);

/// Time that the release at the end may take beyond its ramp.
const RELEASE_GRACE: Duration = Duration::from_millis(800);

/// Has what was said last written before the end of the process, also after a panic, and for a moment only.
struct LastLines;

impl LastLines {
    /// Time that it may take where nothing blocks it.
    const TIME: Duration = Duration::from_millis(700);
}

impl Drop for LastLines {
    fn drop(&mut self) {
        log::flush(Self::TIME);
    }
}

/// The loop and everything around it, ready to be started.
struct Prepared {
    tick: Tick<dyn Device>,
    settings: ThreadSettings,
    status: RealTimeStatus,
    shared: Arc<Shared>,
    records: rt::outbox::Consumer,
    facts: Facts,
    scene: Scene,
    cpus: Vec<usize>,
    keeper: Option<Keeper>,
}

fn prepare(config: Config) -> Result<Prepared, Failure> {
    let mut status = RealTimeStatus::default();
    privileges::lock_memory(&mut status);
    let awake = config
        .keep_cpus_awake
        .then(|| privileges::keep_cpus_awake(&mut status))
        .flatten();
    let shared = Arc::new(Shared::new());
    let (producer, records) = rt::outbox::outbox();
    #[expect(clippy::cast_precision_loss, reason = "at most 10 000 000 ns")]
    let period_s = config.period_ns as f64 * 1e-9;
    let renderer = Renderer::new(&config.scene, config.scheme, period_s)?;
    let scene = Box::new(CompiledScene::at_once(renderer, FIRST_REVISION));
    let PreparedDevice { device, link, losses } = prepare_device(config.rig, config.period_ns);
    let description = device.description();
    let resolution = device.resolution_m();
    let (monitor, keeper) = link.unzip();
    let settings = Settings {
        period_s,
        ramp_s: config.ramp_s,
        limits: config.limits,
        losses,
        passivity_control_n: config.passivity_control_n,
        velocity: config.velocity,
        stale_ns: config.watches.stale_ns,
        stop_button: config.watches.stop_button,
        enable_button: config.watches.enable_button,
    };
    let mut servo = Servo::new(settings, scene);
    if monitor.is_some() {
        // Before the first sample of a device that is yet to be found, nobody engages it.
        servo.disconnect();
    }
    let lateness = Lateness::new(config.late_policy);
    let control_timeout_ns = config.watches.control_timeout_ns;
    let tick = Tick::new(
        device,
        Arc::clone(&shared),
        producer,
        servo,
        lateness,
        control_timeout_ns,
    );
    let share = claim_processor(config.cpu.filter(|_| config.policy != Policy::Deadline), &mut status);
    let phase_ns = share.as_ref().map_or_else(
        || processor_share::usual_phase_ns(config.period_ns),
        |share| share.phase_ns(config.period_ns),
    );
    let facts = Facts {
        server: format!("hapticd {}", env!("CARGO_PKG_VERSION")),
        device: description,
        address: config.device,
        servo: settings,
        _awake: awake,
        share,
        keeper: None,
        rig: RigFacts {
            period_s,
            // The rig in this process measures when it is read, and is driven in the same tick; of
            // a link that is measured.
            sample_period_s: 0.0,
            delay_s: 0.0,
            damping: losses.damping,
            friction: losses.friction,
            resolution,
        },
        link: monitor,
        period_ns: config.period_ns,
        ramp: Duration::from_secs_f64(config.ramp_s),
        rules: config.rules,
        state_dir: config.state_dir,
        scheme: config.scheme,
        scene_dir: config.scene_dir,
        real_time: RealTimeStatus::default(),
    };
    Ok(Prepared {
        tick,
        settings: ThreadSettings {
            period_ns: config.period_ns,
            phase_ns,
            cpu: config.cpu,
            policy: config.policy,
            spin_ns: config.spin_ns,
        },
        status,
        shared,
        records,
        facts,
        scene: config.scene,
        cpus: config.available_cpus,
        keeper,
    })
}

/// The share of the processor that the loop is to be pinned to.
fn claim_processor(cpu: Option<usize>, status: &mut RealTimeStatus) -> Option<ProcessorShare> {
    match ProcessorShare::claim(cpu?) {
        Ok(share) => Some(share),
        Err(error) => {
            status.problems.push(Problem {
                what: format!("whether another daemon has its loop on the same processor cannot be seen: locking /dev/null says {error}"),
                remedy: "allow fcntl(F_OFD_SETLK) in the filter of system calls that the daemon runs under, and /dev/null for writing".to_owned(),
            });
            None
        }
    }
}

/// The device's real-time end, and the rest of its link where it has one.
struct PreparedDevice {
    device: Box<dyn Device>,
    link: Option<(LinkMonitor, Keeper)>,
    losses: RigLosses,
}

fn prepare_device(rig: RigChoice, period_ns: u64) -> PreparedDevice {
    match rig {
        RigChoice::Fake(rig) => PreparedDevice {
            losses: RigLosses {
                damping: rig.properties().damping_ns_per_m,
                friction: rig.properties().friction_n,
            },
            device: Box::new(rig),
            link: None,
        },
        RigChoice::Linked { connector, losses } => {
            let (device, monitor, keeper) = Keeper::new(connector, period_ns);
            PreparedDevice {
                device: Box::new(device),
                link: Some((monitor, keeper)),
                losses,
            }
        }
    }
}

/// Starts the real-time thread; returns it and the control thread's hold on the rig.
fn start_loop(config: Config) -> Result<(RunningLoop, RigHandle), Failure> {
    let mut prepared = prepare(config)?;
    let ThreadSettings { period_ns, cpu, .. } = prepared.settings;
    let (running, status) = rt::thread::start(
        prepared.tick,
        Arc::clone(&prepared.shared),
        prepared.settings,
        prepared.status,
    )?;
    if let Some(cpu) = cpu {
        privileges::leave_cpu_alone(cpu, &prepared.cpus);
    }
    // After that, so that it keeps off the loop's processor as well.
    prepared.facts.keeper = prepared.keeper.map(Keeper::start).transpose()?;
    prepared.facts.real_time = status;
    let feed = Feed::new(prepared.records, period_ns, prepared.facts.link.clone());
    let rig = RigHandle::new(prepared.facts, prepared.shared, feed, prepared.scene, FIRST_REVISION);
    Ok((running, rig))
}

/// The loop beside a bare one, without anybody to serve.
fn run_self_test(config: Config, turn_s: u64) -> Result<(), Failure> {
    let prepared = prepare(config)?;
    // With force, as in use.
    prepared.shared.send(1, Command::Engage, prepared.shared.stops());
    let control = self_test::ControlSide {
        shared: prepared.shared,
        records: prepared.records,
    };
    let serving = control.serve(prepared.settings.cpu, prepared.cpus)?;
    let period_ns = prepared.settings.period_ns;
    let mut tick = prepared.tick;
    let measure =
        move |waiting| self_test::compare(&mut tick, serving, turn_s, period_ns, waiting).report(period_ns, waiting);
    let (report, status) = rt::thread::on_prepared_thread(prepared.settings, prepared.status, measure)?;
    for problem in &status.problems {
        say_problem(problem);
    }
    writeln!(std::io::stdout().lock(), "{report}")?;
    Ok(())
}

fn say_problem(problem: &Problem) {
    say(&format!(
        "{}
         to mend it: {}",
        problem.what, problem.remedy
    ));
}

/// Says what runs, where, and what it could not have.
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

async fn pump(rig: &RigHandle) {
    let mut pause = tokio::time::interval(PUMP_PERIOD);
    loop {
        pause.tick().await;
        rig.beat();
        rig.pump();
    }
}

/// Lets the force down along its ramp before the end.
async fn release(rig: &RigHandle) {
    // A rig that is stopped or faulted refuses, and has no force to let down.
    if rig.command(Command::Release, rig.stops(), None).await.is_err() {
        return;
    }
    while rig.feed().newest().is_some_and(|record| record.state.is_live()) {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    // Whoever stopped it meanwhile is still to hear so.
    tokio::time::sleep(FAREWELL).await;
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
        assert_eq!(judged(FinalZero::Taken), Ok(()));
        assert_eq!(judged(FinalZero::NoDevice), Ok(()), "it was unplugged before");
        let told = judged(FinalZero::NotTaken).expect_err("there may still be a force");
        assert!(told.contains("did not take the zero force: cut the power"), "{told}");
        let hangs = judge(None).expect_err("nobody knows").to_string();
        assert!(hangs.contains("hangs: cut the power"), "{hangs}");
    }
}
