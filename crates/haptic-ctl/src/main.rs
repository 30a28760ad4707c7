//! haptic-ctl: the command line of hapticd, one file a subcommand.

mod accuracy;
mod advise;
mod all;
mod change;
mod command_line;
mod commission;
mod compare;
mod complete;
mod condition;
mod console;
mod daemon;
mod describe;
mod devices;
mod doctor;
mod drive;
mod failure;
mod generated;
mod get;
mod hint;
mod identify;
mod lease;
mod log;
mod output;
mod progress;
mod raw;
mod record;
mod recording;
mod replay;
mod scene;
mod schedule;
mod set;
mod simulate;
mod status;
mod stick_slip;
mod stop;
mod study;
mod surface;
mod table_file;
mod table_options;
mod timing;
mod top;
mod units;
mod wait;
mod words;

use clap::{CommandFactory, FromArgMatches};
use command_line::{Arguments, Command, command_line};
use daemon::Daemon;
use failure::Failure;
use haptic_ipc::RigState;
use std::process::ExitCode;
use stop::NamedRig;

fn main() -> ExitCode {
    clap_complete::CompleteEnv::with_factory(Arguments::command).complete();
    let words = words::in_order(std::env::args_os().collect());
    let parse = |command: clap::Command| {
        let matches = command.try_get_matches_from(&words)?;
        Arguments::from_arg_matches(&matches)
    };
    let parsed = match parse(Arguments::command()) {
        Err(error) if error.use_stderr() && words::mean_a_stop(&words, &Arguments::command()) => {
            let json = words::wants_json();
            return done(stop::in_spite_of(&words::error_text(&error), 2, json), json);
        }
        parsed => {
            hint::choose(&words);
            // The help is made only where it is shown: it takes most of the time that the program takes to start.
            parsed.or_else(|_| parse(command_line()))
        }
    };
    let arguments = match parsed {
        Ok(arguments) => arguments,
        Err(mut error) => {
            words::suggest(&mut error, &Arguments::command());
            return words::end(&error);
        }
    };
    let json = arguments.json;
    output::choose(arguments.quiet);
    let work = async {
        tokio::select! {
            // In this order: offline work is done before the interrupt is caught, which would
            // otherwise be noticed only after that work.
            biased;
            ended = run(&arguments) => ended,
            _ = tokio::signal::ctrl_c(), if !arguments.command.handles_interrupts() => Err(Failure::Interrupted),
        }
    };
    done(work, json)
}

/// Does something to its end.
fn done(work: impl Future<Output = Result<(), Failure>>, json: bool) -> ExitCode {
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return Failure::from(error).report(json),
    };
    let result = runtime.block_on(work);
    // A thread that reads the terminal may still wait for a key: it is left behind.
    runtime.shutdown_background();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(json),
    }
}

async fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (json, command) = (arguments.json, &arguments.command);
    if arguments.all {
        return all::run(command, arguments.socket.as_deref(), json).await;
    }
    let named = NamedRig {
        rig: arguments.rig_name.as_deref(),
        socket: arguments.socket.as_deref(),
    };
    let named_socket = named.path();
    let socket = named_socket.as_deref();
    match command {
        Command::Doctor => return doctor::run(named.one_path()?.as_deref(), json).await,
        Command::Recording(recording) => return recording::run(recording, json),
        Command::Replay(replay) => return replay::run(socket, replay, json).await,
        Command::Simulate(simulate) => return simulate::run(socket, simulate, json).await,
        Command::Accuracy => return accuracy::run(json),
        Command::Identify(arguments) if arguments.is_offline() => return identify::run_offline(arguments, json),
        Command::Advise(arguments) => {
            if let Some(speed) = arguments.at_speed {
                return stick_slip::run(socket, arguments, speed, json).await;
            }
        }
        Command::Compare(compare) => return compare::run(compare, json),
        Command::Surface(surface) => return surface::run(socket, surface, json).await,
        Command::Study(study) => return study::run(study, json).await,
        Command::Describe(describe::Arguments { scene: Some(scene) }) => {
            return describe::named(socket, scene, json).await;
        }
        Command::Raw(raw) if raw.schema => return raw::schema(),
        Command::Completions { shell } => return generated::completions(*shell),
        Command::Man { folder } => return generated::manual(folder, command_line()),
        _ => {}
    }
    if let Command::Raw(raw) = command {
        return raw::run(named.one_path()?.as_deref(), raw).await;
    }
    // A wrong command line is refused before the daemon is asked.
    let request = command.request()?;
    if let Command::Stop = command {
        return stop::run(&named, json).await;
    }
    let needs_daemon = !matches!(command, Command::Devices(devices) if !devices.needs_daemon());
    let meant = match named.one_path() {
        Err(_) if !needs_daemon => return devices::run_here(json),
        meant => meant?,
    };
    let socket = meant.as_deref();
    let connected = Daemon::connect(socket).await;
    if connected.is_err() && !needs_daemon {
        return devices::run_here(json);
    }
    let daemon = &mut connected?;
    match command {
        Command::Status => status::run(daemon, socket, json).await,
        Command::Top => top::run(daemon, socket).await,
        Command::Describe(_) => describe::active(daemon, json).await,
        Command::Get(get) => get::run(daemon, get, request, json).await,
        Command::Set(set) => change::run(daemon, request, set.change.wait, json).await,
        Command::Undo(change) | Command::Redo(change) => change::run(daemon, request, change.wait, json).await,
        Command::Scene(scene) => scene.run(daemon, request, json).await,
        Command::Schedule(_) => schedule::run(daemon, request, json).await,
        Command::Log(log) => log::run(daemon, log, json).await,
        Command::Engage(arguments) => drive::engage(daemon, arguments, json).await,
        Command::Release(waiting) => drive::run_to(daemon, request, RigState::Idle, waiting, json).await,
        Command::Reload => drive::reload(daemon, request, json).await,
        Command::Commission(arguments) => commission::run(daemon, arguments, json).await,
        Command::Identify(arguments) => identify::run(daemon, arguments, json).await,
        Command::Wait(wait) => wait::run(daemon, wait, json).await,
        Command::Lease(lease) => lease::run(daemon, lease).await,
        Command::Record(record) => record::run(daemon, record, json).await,
        Command::Timing => timing::run(daemon, json).await,
        Command::Advise(_) => advise::run(daemon, json).await,
        Command::Devices(_) => devices::run(daemon, request, json).await,
        _ => drive::run(daemon, request, json).await,
    }
}
