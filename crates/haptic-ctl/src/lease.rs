//! `lease`: a command as a dead man's switch. The rig is released should haptic-ctl, and with it
//! the command, die or hang.

use crate::console::Signals;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::units::duration;
use haptic_ipc::{JournalEntry, LeaseReply, LogReply, Request};
use nix::sys::signal::{SigHandler, Signal};
use std::ffi::OsString;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::time::Duration;
use tokio::process::{Child, Command};

pub(crate) const HELP: &str = "\
The exit code is the command's; after 0 the rig stays as it is, and 6 says that the lease had lapsed meanwhile. \
SIGTERM, SIGHUP and a SIGINT that is not the terminal's are passed on; the command of a killed haptic-ctl gets SIGTERM.

Example:
  haptic-ctl lease --timeout 200ms -- python3 experiment.py";

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Silence of haptic-ctl after which the rig is released, from 20ms to 60s
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = duration, allow_hyphen_values = true)]
    timeout: Duration,

    /// Command to run, after `--`
    #[arg(required = true, last = true, value_name = "COMMAND")]
    command: Vec<OsString>,
}

impl Arguments {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        // A time below a millisecond must not become 0, which ends a lease.
        let timeout_ms = self.timeout.as_millis().max(1);
        let timeout_ms = u32::try_from(timeout_ms).map_err(|_| {
            Failure::Usage(format!(
                "--timeout = {timeout_ms} ms is out of range: it must be from 20 to 60000 ms"
            ))
        })?;
        Ok(Request::Lease { timeout_ms })
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments) -> Result<(), Failure> {
    let request = arguments.request()?;
    // Caught before the command runs, so that none of them ends haptic-ctl and leaves the command
    // behind.
    let mut signals = Signals::new()?;
    let _: LeaseReply = daemon.ask(request.clone()).await?;
    let (program, rest) = arguments
        .command
        .split_first()
        .ok_or_else(|| Failure::Usage("there is no command to run".to_owned()))?;
    let mut command = Command::new(program);
    command.args(rest);
    end_with_this_process(&mut command);
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => {
            end(daemon).await?;
            return Err(Failure::Usage(format!("{}: {error}", program.display())));
        }
    };
    // Three renewals in the time: one may come late.
    let mut renewals = tokio::time::interval(arguments.timeout / 3);
    renewals.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut lost = None;
    let status = loop {
        tokio::select! {
            ended = child.wait() => break ended?,
            _ = renewals.tick(), if lost.is_none() => {
                if let Err(failure) = daemon.ask::<LeaseReply>(request.clone()).await {
                    eprintln!("haptic-ctl: the lease is lost: {failure}");
                    lost = Some(failure);
                }
            }
            signal = signals.next() => {
                // A terminal sends an interrupt to the command too.
                if signal != rustix::process::Signal::INT || !is_in_foreground() {
                    pass_on(&child, signal);
                }
            }
        }
    };
    match (code(status), lost) {
        (0, Some(failure)) => Err(failure),
        (0, None) => {
            end(daemon).await?;
            has_held(daemon, arguments.timeout).await
        }
        // The lease is not ended: with the connection it lapses, and the rig is released.
        (code, _) => Err(Failure::Silent(code)),
    }
}

/// Refuses a lease that lapsed: it held again, but the rig had been released.
async fn has_held(daemon: &mut Daemon, timeout: Duration) -> Result<(), Failure> {
    let request = Request::Log {
        after: None,
        limit: Some(usize::MAX),
    };
    let log: LogReply = daemon.ask(request).await?;
    let session = &daemon.hello().session;
    let is_own = |entry: &JournalEntry| entry.by.as_ref().is_some_and(|by| by.session == *session);
    let lapsed = |entry: &&JournalEntry| entry.op == "lease_lapsed" && is_own(entry);
    match log.entries.iter().find(lapsed) {
        Some(JournalEntry { seq, .. }) => Err(Failure::Halted(format!(
            "the lease lapsed while the command ran: haptic-ctl was silent for more than {timeout:?}, and the rig was \
             released (entry {seq} of `haptic-ctl log`)"
        ))),
        None => Ok(()),
    }
}

async fn end(daemon: &mut Daemon) -> Result<(), Failure> {
    let _: LeaseReply = daemon.ask(Request::Lease { timeout_ms: 0 }).await?;
    Ok(())
}

/// Lets the kernel end the command when this process dies, however it dies: without the lease it would continue with a
/// rig that is released.
fn end_with_this_process(command: &mut Command) {
    let parent = nix::unistd::getpid();
    let before = move || {
        // This process catches it, and so does its copy until the command has taken its place.
        // SAFETY: no handler is installed, and nobody asks for the one before.
        #[expect(unsafe_code, reason = "the call has no safe wrapper")]
        unsafe {
            nix::sys::signal::signal(Signal::SIGTERM, SigHandler::SigDfl)?;
        }
        nix::sys::prctl::set_pdeathsig(Signal::SIGTERM)?;
        // It may have died before the kernel was asked.
        if nix::unistd::getppid() == parent {
            Ok(())
        } else {
            Err(nix::errno::Errno::ESRCH.into())
        }
    };
    // SAFETY: between fork and exec three system calls are made, and nothing is allocated or locked.
    #[expect(unsafe_code, reason = "what runs between fork and exec has no safe wrapper")]
    unsafe {
        command.pre_exec(before);
    }
}

/// Whether this process is in the foreground of its terminal, where ^C goes to it and to the command.
fn is_in_foreground() -> bool {
    let terminal = std::fs::File::open("/dev/tty").map_err(drop);
    let foreground = terminal.and_then(|terminal| rustix::termios::tcgetpgrp(&terminal).map_err(drop));
    foreground == Ok(rustix::process::getpgrp())
}

fn pass_on(child: &Child, signal: rustix::process::Signal) {
    let pid = child.id().and_then(|id| i32::try_from(id).ok());
    if let Some(pid) = pid.and_then(rustix::process::Pid::from_raw)
        && let Err(error) = rustix::process::kill_process(pid, signal)
    {
        eprintln!("haptic-ctl: the signal cannot be passed on: {error}");
    }
}

/// As a shell has it: the code, or 128 and the signal.
fn code(status: ExitStatus) -> u8 {
    let code = status.code().or_else(|| status.signal().map(|signal| 128 + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(1)
}
