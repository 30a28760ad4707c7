//! The command line: options, subcommands, and what each asks of the daemon.

use crate::change::ChangeArguments;
use crate::failure::Failure;
use crate::fields::{Fields, Schema};
use crate::rig_name::rig_name;
use crate::{
    accuracy, advise, commission, compare, completions, cost, devices, doctor, drive, events, examples, get, identify,
    lease, log, man, raw, record, recording, reload, replay, scene, schedule, set, simulate, study, surface, top, undo,
    wait,
};
use clap::{CommandFactory, Parser, Subcommand};
use haptic_ipc::Request;
use std::path::PathBuf;

/// Controls a running hapticd: shows and changes how the rig feels.
#[derive(Debug, Parser)]
#[command(name = "haptic-ctl", version, max_term_width = 110, after_help = EXIT_CODES)]
pub(crate) struct Arguments {
    /// Control socket of the daemon [default: $HAPTICD_SOCKET, else the first that exists of
    /// hapticd/control.sock in the user's runtime directory, in ~/.local/state and in /run]
    #[arg(long, global = true, value_name = "PATH", help_heading = GLOBAL)]
    pub(crate) socket: Option<PathBuf>,

    /// Rig of this name: the daemon of the service hapticd@NAME
    #[arg(long = "rig", value_name = "NAME", value_parser = rig_name, conflicts_with = "socket")]
    pub(crate) rig_name: Option<String>,

    /// Every rig of this machine: those of the services hapticd and hapticd@NAME, of sockets that were forwarded to the
    /// place of one, and of --socket. Only for `status` and `stop`
    #[arg(long, conflicts_with = "rig_name")]
    pub(crate) all: bool,

    /// Print JSON, with the field names of the control protocol; or only some fields of it, as in
    /// --json=state,device.description
    #[arg(long, global = true, value_name = "FIELDS", require_equals = true, help_heading = GLOBAL)]
    pub(crate) json: Option<Option<Fields>>,

    /// Print only what was asked for, and errors: no advice, no progress, no heading, no word of an
    /// action that was done
    #[arg(long, short, global = true, help_heading = GLOBAL)]
    pub(crate) quiet: bool,

    /// Print the requests to the daemon instead of sending them
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub(crate) print_request: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The heading of the options of every subcommand.
const GLOBAL: &str = "Options of every subcommand";

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 refused by the daemon or not written, 2 wrong usage, 3 no daemon, 4 no permission, 5 no answer, or timed out, \
6 the rig is stopped or faulted, 130 interrupted.

With --json an error is one object on standard error. Its code is the daemon's own (docs/control.md), or one of \
these: usage (exit code 2), \
no_daemon (3), no_permission (4), no_answer and timed_out (5), halted (6), other_version, bad_answer, bad_rig, bad_recording, \
not_comparable, no_device and cannot_write (1). docs/control.md says what the exit code of each subcommand means.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show the state of the rig, the scene, the device and the real-time thread
    Status,
    /// Show the rig live, with keys to stop, engage and release it
    Top,
    /// Show the scene's law and its parameters: symbols, units, ranges, and what each makes the hand feel
    Describe,
    /// Show the active scene, or another
    Get(get::Arguments),
    /// Set parameters: all of them or none, between two ticks
    #[command(after_help = set::parameter_help())]
    Set(set::Arguments),
    /// Undo the newest change, of any client
    Undo(ChangeArguments),
    /// Redo the change that was undone last
    Redo(ChangeArguments),
    /// List, load, save, compare and show whole scenes
    #[command(subcommand)]
    Scene(scene::Command),
    /// Change the scene in ticks to come: a list of changes from a file, all of them or none
    #[command(after_help = schedule::HELP)]
    Schedule(schedule::Arguments),
    /// Show who changed what, and when, since the daemon began; `events` shows what is still to come
    Log(log::Arguments),
    /// Ramp the force up
    Engage(drive::EngageArguments),
    /// Ramp the force down
    Release(drive::WaitArguments),
    /// Set zero force at once, of every rig in reach or of one that is named; exits 0 only when all
    /// have confirmed it
    Stop,
    /// Clear a stop or a fault; the rig is then idle
    Reset,
    /// Read the limits in the daemon's configuration again, and look through the library, while force flows on
    #[command(after_help = reload::HELP)]
    Reload,
    /// Commission the rig: find the direction of its motor, its range and its friction by small
    /// pulses, and store them. A rig engages only after that
    #[command(after_help = commission::HELP)]
    Commission(commission::Arguments),
    /// Identify mass and friction from a record of motion and force, of what the rig moves, or of the rig itself
    Identify(Box<identify::Arguments>),
    /// Wait until a condition holds, as in --until state=engaged
    #[command(after_help = wait::help())]
    Wait(wait::Arguments),
    /// Run a command; release the rig if the command fails, or if haptic-ctl dies or hangs
    #[command(after_help = lease::HELP)]
    Lease(lease::Arguments),
    /// Show what happens, live, until interrupted: states, the journal, samples, timing; with --json one
    /// object a line
    #[command(after_help = events::HELP)]
    Events(events::Arguments),
    /// Record every tick to a file, with what happens meanwhile, until interrupted
    #[command(after_help = record::HELP)]
    Record(record::Arguments),
    /// Show, repair, convert and cut recordings; works without a daemon
    #[command(subcommand)]
    Recording(recording::Command),
    /// Compute a recording's forces again, offline, and compare them to the last bit; or render its
    /// motion with another scene
    #[command(after_help = replay::HELP)]
    Replay(replay::Arguments),
    /// Show how well the loop keeps time
    Timing,
    /// Check the active scene against the rig: stability, passivity and chatter, with a fix for
    /// each; or reckon the stick-slip of a scene at a speed
    Advise(advise::Arguments),
    /// List the devices that are plugged in, their addresses, and problems that keep one from use;
    /// works without a daemon
    Devices(devices::Arguments),
    /// Check everything between you and the rig, with a fix for each problem; works without a
    /// daemon
    Doctor,
    /// Send raw lines of the control protocol, and print the answers
    Raw(raw::Arguments),
    /// Render a scene along a recorded motion, offline, with the code of the daemon
    Simulate(simulate::Arguments),
    /// Measure the cost and the error of each scheme, offline, on easy and hard scenes
    Accuracy(accuracy::Arguments),
    /// Measure the cost of a tick of each kind of scene, offline: instructions, bytes of state,
    /// nanoseconds
    Cost,
    /// Compare the recording of a rendered surface with the record of the real one
    #[command(after_help = compare::HELP)]
    Compare(compare::Arguments),
    /// Record a simulated surface as a lab records a real one, offline: strokes at 0.5 to 3 Hz and slow
    /// ramps, a force sensor's noise, an encoder's steps
    Surface(surface::Arguments),
    /// Run studies (the targeting task and the perception tests) and analyse them; works without a daemon
    #[command(subcommand)]
    Study(study::Command),
    /// Print the completion script of a shell
    Completions { shell: completions::Shell },
    /// Write the manual pages
    Man(man::Arguments),
    /// The code that callgrind counts
    #[command(hide = true, name = cost::PROBE)]
    Probe { probe: haptic_lab::cost::Probe },
}

impl Command {
    /// The requests of the subcommand, in order; none where it works offline.
    pub(crate) fn requests(&self) -> Result<Vec<Request>, Failure> {
        Ok(vec![match self {
            Self::Status => Request::Status {},
            Self::Top => return Ok(top::requests()),
            Self::Describe => Request::Describe {},
            Self::Get(get) => get.request()?,
            Self::Set(set) => set.request()?,
            Self::Undo(change) => undo::undo(change),
            Self::Redo(change) => undo::redo(change),
            Self::Scene(scene) => scene.request()?,
            Self::Schedule(schedule) => schedule.request()?,
            Self::Log(log) => log.request(),
            Self::Engage(engage) => engage.request(),
            Self::Release(_) => Request::Release {},
            Self::Stop => Request::Stop {},
            Self::Reset => Request::Reset {},
            Self::Reload => Request::Reload {},
            Self::Commission(_) => return Ok(commission::Arguments::requests()),
            Self::Identify(identify) => return Ok(identify.requests()),
            Self::Wait(wait) => return Ok(wait.requests()),
            Self::Lease(lease) => lease.request()?,
            Self::Events(events) => return events.requests(),
            Self::Record(record) => return record.requests(),
            Self::Replay(replay) => return replay.requests(),
            Self::Simulate(simulate) => return simulate.requests(),
            Self::Surface(surface) => return surface.requests(),
            Self::Timing => Request::Timing {},
            Self::Advise(advise) => return advise.requests(),
            Self::Devices(devices) => devices.request(),
            Self::Doctor => return Ok(doctor::requests()),
            Self::Raw(_)
            | Self::Recording(_)
            | Self::Accuracy(_)
            | Self::Cost
            | Self::Compare(_)
            | Self::Study(_)
            | Self::Completions { .. }
            | Self::Man(_)
            | Self::Probe { .. } => return Ok(Vec::new()),
        }])
    }

    /// What stands in the JSON that is printed, where the protocol says it.
    pub(crate) fn schema(&self) -> Option<Schema> {
        Some(match self {
            Self::Events(_) => events::Arguments::schema(),
            Self::Log(_) => Schema::of_types(&["JournalEntry"], &[]),
            Self::Get(get) if get.is_one_value() => return None,
            Self::Advise(advise) if advise.at_speed.is_some() => return None,
            Self::Scene(scene::Command::Show(_)) => Schema::of_types(&["Scene"], &[]),
            Self::Status
            | Self::Describe
            | Self::Get(_)
            | Self::Set(_)
            | Self::Undo(_)
            | Self::Redo(_)
            | Self::Scene(_)
            | Self::Engage(_)
            | Self::Release(_)
            | Self::Stop
            | Self::Reset
            | Self::Reload
            | Self::Timing
            | Self::Advise(_)
            | Self::Devices(_) => Schema::of_answer_to(self.requests().ok()?.first()?),
            Self::Schedule(_) => Schema::of_types(&["ScheduleReply", "ScheduleCancelReply", "JournalEntry"], &[]),
            _ => return None,
        })
    }

    /// Whether it ends cleanly by itself when it is interrupted.
    pub(crate) const fn handles_interrupts(&self) -> bool {
        matches!(self, Self::Record(_) | Self::Lease(_) | Self::Top | Self::Study(_))
    }
}

/// The command line, with its help.
pub(crate) fn command_line() -> clap::Command {
    examples::add(Arguments::command())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_subcommand_is_in_the_table_of_exit_codes() {
        let page = include_str!("../../../docs/control.md");
        let (_, table) = page.split_once("| subcommand | asks the daemon |").expect("the table");
        let (table, _) = table.split_once("\n\n").expect("its end");
        let names: Vec<&str> = table
            .lines()
            .filter_map(|line| line.split('|').nth(1))
            .flat_map(|names| names.split('`').skip(1).step_by(2))
            .filter_map(|name| name.split(' ').next())
            .collect();
        let command = Arguments::command();
        let subcommands = command.get_subcommands().filter(|command| !command.is_hide_set());
        let mut known = vec!["--wait"];
        for subcommand in subcommands {
            assert!(
                names.contains(&subcommand.get_name()),
                "{} is not in the table",
                subcommand.get_name()
            );
            known.push(subcommand.get_name());
        }
        for name in names {
            assert!(known.contains(&name), "there is no subcommand {name}");
        }
    }

    #[test]
    fn every_option_that_takes_a_number_takes_a_negative_one() {
        fn check(command: &clap::Command) -> usize {
            let numbers = command.get_arguments().filter(|argument| {
                let parser = argument.get_value_parser().type_id();
                argument.get_action().takes_values() && parser == std::any::TypeId::of::<f64>()
            });
            let mut count = 0;
            for argument in numbers {
                let name = argument.get_id();
                assert!(argument.is_allow_hyphen_values_set(), "{}: {name}", command.get_name());
                count += 1;
            }
            count + command.get_subcommands().map(check).sum::<usize>()
        }
        let mut command = Arguments::command();
        command.build();
        assert!(check(&command) >= 4);
        for number in ["-2e-5", "-2E-5", "-.5", "-3"] {
            let read = Arguments::try_parse_from([
                "haptic-ctl",
                "simulate",
                "s.toml",
                "--motion",
                "m.csv",
                "--out",
                "o.csv",
                "--block-position",
                number,
                "--block-velocity",
                number,
            ]);
            assert!(read.is_ok(), "{number}: {read:?}");
        }
    }
}
