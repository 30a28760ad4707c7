//! haptic-ctl: the command line of hapticd, one file a subcommand.

mod accuracy;
mod advise;
mod cost;
mod describe;
mod devices;
mod drive;
mod failure;
mod get;
mod output;
mod set;
mod simulate;
mod status;
mod timing;
mod watch;

use clap::{Parser, Subcommand};
use failure::Failure;
use haptic_ipc::{AsyncClient, Request, socket_path};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Steers a running hapticd: shows and changes what the rig feels like.
#[derive(Debug, Parser)]
#[command(name = "haptic-ctl", version, max_term_width = 110, after_help = EXIT_CODES)]
struct Arguments {
    /// The daemon's control socket [default: $HAPTICD_SOCKET, else the first that exists of hapticd/control.sock in
    /// the user's runtime directory and /run/hapticd/control.sock]
    #[arg(long, global = true, value_name = "PATH")]
    socket: Option<PathBuf>,

    /// Print JSON, with the field names of the control protocol
    #[arg(long, global = true)]
    json: bool,

    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 refused by the daemon, 2 wrong usage, 3 no daemon, 4 no permission, 5 no answer in time, \
6 the rig is stopped or faulted, 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Show the rig's state, the scene, the device and what the real-time thread has
    Status,
    /// Show the parameter table: names, symbols, units, ranges, and what each makes the hand feel
    Describe,
    /// Show the scene in force
    Get,
    /// Change parameters, all of them or none, between two ticks
    #[command(after_help = set::parameter_help())]
    Set(set::Arguments),
    /// Let the force in, along a ramp
    Engage,
    /// Let the force out, along a ramp
    Release,
    /// Zero force, at once; exits 0 only when the daemon has confirmed it
    Stop,
    /// Clear a stop or a fault; the rig is then idle
    Reset,
    /// Show how well the loop keeps time
    Timing,
    /// Show what the scene in force will do to the rig: stability, passivity and chatter, with what would mend each
    Advise,
    /// List the devices that are plugged in, how to name them, and why one cannot be used
    Devices(devices::Arguments),
    /// Show samples as they come, until interrupted
    Watch(watch::Arguments),
    /// Render a scene along a recorded motion, offline, by the code that the daemon runs
    Simulate(simulate::Arguments),
    /// Measure what each scheme costs and how far it is from the true motion, offline, on easy and hard scenes
    Accuracy(accuracy::Arguments),
    /// Measure what a tick of each kind of scene costs, offline: instructions, bytes of state, nanoseconds
    Cost,
    /// What callgrind counts
    #[command(hide = true, name = cost::PROBE)]
    Probe { probed: cost::Probed },
}

/// How long an answer may take before the daemon counts as hung.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return Failure::from(error).report(arguments.json),
    };
    let ended = runtime.block_on(async {
        tokio::select! {
            // In this order, so that offline work is done before the interrupt is caught, which would then be heard only after it.
            biased;
            ended = run(&arguments) => ended,
            _ = tokio::signal::ctrl_c() => Err(Failure::Interrupted),
        }
    });
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(arguments.json),
    }
}

async fn run(arguments: &Arguments) -> Result<(), Failure> {
    let json = arguments.json;
    let drive = async |request| drive::run(&mut Daemon::connect(arguments).await?, request, json).await;
    match &arguments.command {
        Command::Status => status::run(&mut Daemon::connect(arguments).await?, json).await,
        Command::Describe => describe::run(&mut Daemon::connect(arguments).await?, json).await,
        Command::Get => get::run(&mut Daemon::connect(arguments).await?, json).await,
        Command::Set(set) => {
            // What can be refused here is refused before anybody is asked.
            let changes = set.changes()?;
            set::run(&mut Daemon::connect(arguments).await?, changes, json).await
        }
        Command::Engage => drive(Request::Engage {}).await,
        Command::Release => drive(Request::Release {}).await,
        Command::Stop => drive(Request::Stop {}).await,
        Command::Reset => drive(Request::Reset {}).await,
        Command::Timing => timing::run(&mut Daemon::connect(arguments).await?, json).await,
        Command::Advise => advise::run(&mut Daemon::connect(arguments).await?, json).await,
        Command::Devices(devices) => devices::run(&mut Daemon::connect(arguments).await?, devices, json).await,
        Command::Watch(watch) => watch::run(&mut Daemon::connect(arguments).await?, watch, json).await,
        Command::Simulate(simulate) => simulate::run(simulate, json),
        Command::Accuracy(accuracy) => accuracy::run(accuracy, json),
        Command::Cost => cost::run(json),
        Command::Probe { probed } => cost::probe(*probed),
    }
}

async fn in_time<T>(answer: impl Future<Output = Result<T, haptic_ipc::ClientError>>) -> Result<T, Failure> {
    match tokio::time::timeout(ANSWER_TIMEOUT, answer).await {
        Ok(answer) => Ok(answer?),
        Err(_) => Err(Failure::NoAnswer(ANSWER_TIMEOUT)),
    }
}

/// The daemon, as the subcommands ask it.
struct Daemon {
    client: AsyncClient,
}

impl Daemon {
    async fn connect(arguments: &Arguments) -> Result<Self, Failure> {
        let path = socket_path::for_client(arguments.socket.as_deref());
        Ok(Self {
            client: in_time(AsyncClient::connect(&path)).await?,
        })
    }

    async fn ask<R: serde::de::DeserializeOwned>(&mut self, request: Request) -> Result<R, Failure> {
        in_time(self.client.request(request)).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_sound() {
        Arguments::command().debug_assert();
    }
}
