//! The command line: options, subcommands, and what each asks of the daemon.

use crate::change::ChangeArguments;
use crate::failure::Failure;
use crate::{
    advise, commission, compare, describe, devices, drive, generated, get, hint, identify, lease, log, raw, record,
    recording, replay, scene, schedule, set, simulate, study, surface, wait,
};
use clap::{CommandFactory, Parser, Subcommand};
use haptic_ipc::Request;
use haptic_ipc::socket_path::rig_name;
use std::path::PathBuf;

/// Controls a running hapticd: shows and changes how the rig feels.
#[derive(Debug, Parser)]
#[command(name = "haptic-ctl", version, max_term_width = 80, after_long_help = EXIT_CODES, disable_help_subcommand = true)]
pub(crate) struct Arguments {
    /// Control socket [default: $HAPTICD_SOCKET, else the first hapticd/control.sock in the user's runtime directory,
    /// ~/.local/state and /run]
    #[arg(long, global = true, value_name = "PATH", help_heading = GLOBAL)]
    pub(crate) socket: Option<PathBuf>,

    /// Rig of this name: of the service hapticd@NAME, or of hapticd itself
    #[arg(long = "rig", value_name = "NAME", value_parser = rig_name, conflicts_with = "socket")]
    pub(crate) rig_name: Option<String>,

    /// Every rig of this machine, and that of --socket; only for `status`, `stop`, `doctor`
    #[arg(long, conflicts_with = "rig_name")]
    pub(crate) all: bool,

    /// Print JSON, with the field names of the control protocol
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub(crate) json: bool,

    /// Print only what was asked for, and errors
    #[arg(long, short, global = true, help_heading = GLOBAL)]
    pub(crate) quiet: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The heading of the options of every subcommand.
const GLOBAL: &str = "Options of every subcommand";

/// What the help of a subcommand says of them.
const COMMON_OPTIONS: &str = "Options of every subcommand: haptic-ctl --help";

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 refused by the daemon or not written, 2 wrong usage, 3 no daemon, 4 no permission, 5 no answer, or timed out, \
6 the rig is stopped or faulted, 130 interrupted.

With --json an error is one object on standard error. Its code is the daemon's own (docs/control.md), or one of \
these: usage (exit code 2), \
no_daemon (3), no_permission (4), no_answer and timed_out (5), halted (6), other_version, bad_answer, bad_rig, bad_recording, \
not_comparable, no_device and cannot_write (1). docs/reference/exit-codes.md has those of each subcommand.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show the state of the rig, scene, device and real-time thread
    Status,
    /// Show the rig live, with keys to stop, engage and release it
    Top,
    /// Show the parameters of a scene or law: units, ranges, feel
    Describe(describe::Arguments),
    /// Show the active scene, or another
    Get(get::Arguments),
    /// Set parameters, all in one tick or none
    #[command(after_help = set::parameter_help())]
    Set(set::Arguments),
    /// Undo the newest change, of any client
    Undo(ChangeArguments),
    /// Redo the change that was undone last
    Redo(ChangeArguments),
    /// List, load, save, compare and show whole scenes
    #[command(subcommand)]
    Scene(scene::Command),
    /// Change the scene at given ticks, by a list in a file
    #[command(after_help = schedule::HELP)]
    Schedule(schedule::Arguments),
    /// Show who changed what and when; --follow shows states and samples
    #[command(after_help = log::HELP)]
    Log(log::Arguments),
    /// Ramp the force up
    Engage(drive::EngageArguments),
    /// Ramp the force down
    Release(drive::WaitArguments),
    /// Set zero force at once on every rig, or on the one that is named
    ///
    /// Exits with 0 only when every rig has confirmed zero force.
    Stop,
    /// Clear a stop or a fault; the rig is then idle
    Reset,
    /// Say that the rig of two axes is in its home pose now
    Home,
    /// Reload the limits from the configuration; force flows on
    #[command(after_help = drive::RELOAD_HELP)]
    Reload,
    /// Find the rig's direction, range and friction by small pulses
    ///
    /// A rig engages only after that.
    #[command(after_help = commission::HELP)]
    Commission(commission::Arguments),
    /// Identify mass and friction from a record, or from the rig itself
    #[command(after_help = "Examples:\n  haptic-ctl identify rig.csv --out found.toml\n  haptic-ctl identify --rig")]
    Identify(Box<identify::Arguments>),
    /// Wait until a condition holds, as in --until state=engaged
    #[command(after_help = wait::help())]
    Wait(wait::Arguments),
    /// Run a command; release the rig if it fails or haptic-ctl dies
    #[command(after_help = lease::HELP)]
    Lease(lease::Arguments),
    /// Record every tick and event to a file, until interrupted
    #[command(after_help = record::HELP)]
    Record(record::Arguments),
    /// Show, repair, convert and cut recordings; needs no daemon
    #[command(subcommand)]
    Recording(recording::Command),
    /// Recompute a recording's forces bit by bit; needs no daemon
    #[command(after_help = replay::HELP)]
    Replay(replay::Arguments),
    /// Show how well the loop keeps time
    Timing,
    /// Check the scene against the rig: stability, passivity, chatter
    #[command(after_help = "Example:\n  haptic-ctl advise high-stiction --at-speed 5mm/s --for-frequency 30Hz")]
    Advise(advise::Arguments),
    /// List the devices that are plugged in; needs no daemon
    #[command(after_help = "Example:\n  haptic-ctl devices --probe serial:/dev/ttyACM0")]
    Devices(devices::Arguments),
    /// Check everything between you and the rig, and name the fixes
    ///
    /// Needs no daemon.
    Doctor,
    /// Send raw lines of the control protocol, and print the answers
    Raw(raw::Arguments),
    /// Render a scene along a recorded motion, with the daemon's code
    #[command(after_help = "Example:\n  haptic-ctl simulate lugre --motion hand.csv --out felt.csv")]
    Simulate(simulate::Arguments),
    /// Measure cost and error of each scheme, on easy and hard scenes
    Accuracy,
    /// Compare the recording of a rendered surface with the real one
    #[command(after_help = compare::HELP)]
    Compare(compare::Arguments),
    /// Simulate a lab's record of a surface
    ///
    /// Strokes at 0.5 to 3 Hz and slow ramps.
    Surface(surface::Arguments),
    /// Run and analyse studies: targeting and perception
    #[command(subcommand)]
    Study(study::Command),
    /// Print the completion script of a shell, which a package installs
    #[command(hide = true)]
    Completions { shell: generated::Shell },
    /// Write the manual pages into a folder, for a package
    #[command(hide = true)]
    Man { folder: PathBuf },
}

impl Command {
    /// The request of the subcommand, or the first of several. None of those that work offline gets here.
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        Ok(match self {
            Self::Get(get) => get.request()?,
            Self::Set(set) => set.request()?,
            Self::Undo(change) => Request::Undo {
                options: change.options(),
            },
            Self::Redo(change) => Request::Redo {
                options: change.options(),
            },
            Self::Scene(scene) => scene.request()?,
            Self::Schedule(schedule) => schedule.request()?,
            Self::Log(log) => log.request(),
            Self::Engage(engage) => engage.request(),
            Self::Release(_) => Request::Release {},
            Self::Stop => Request::Stop {},
            Self::Reset => Request::Reset {},
            Self::Home => Request::Home {},
            Self::Reload => Request::Reload {},
            Self::Lease(lease) => lease.request()?,
            Self::Record(record) => record.request()?,
            Self::Devices(devices) => devices.request(),
            _ => Request::Status {},
        })
    }

    /// Whether it ends cleanly by itself when it is interrupted.
    pub(crate) const fn handles_interrupts(&self) -> bool {
        matches!(self, Self::Record(_) | Self::Lease(_) | Self::Top | Self::Study(_))
    }
}

/// The command line, with its help. Options that all subcommands have stand in that of the program alone, and there in
/// the long one.
pub(crate) fn command_line() -> clap::Command {
    fn without_common_options(command: clap::Command) -> clap::Command {
        let command = command.mut_args(|option| {
            let hide = option.is_hide_set() || option.get_help_heading() == Some(GLOBAL);
            option.hide(hide)
        });
        let before = command.get_after_help().map(ToString::to_string);
        let before = before.map(|before| format!("{}\n\n", hint::addressed(&before)));
        let after = before.unwrap_or_default() + COMMON_OPTIONS;
        command.after_help(after).mut_subcommands(without_common_options)
    }
    let mut command = Arguments::command();
    // Hands the options to the subcommands.
    command.build();
    command
        .mut_subcommands(without_common_options)
        .mut_args(|option| option.hide_short_help(true))
        .after_help("Options, and exit codes: haptic-ctl --help")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_help_fits_on_a_screen() {
        let help = command_line().render_help().to_string();
        assert!(help.lines().count() <= 40, "{help}");
    }

    #[test]
    fn every_subcommand_is_in_the_table_of_exit_codes() {
        let page = include_str!("../../../docs/reference/exit-codes.md");
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

    /// The words of a line, as a shell splits it.
    fn words(line: &str) -> Vec<String> {
        let quoted = line.split('\'').enumerate();
        let parts = quoted.flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        });
        parts.collect()
    }

    #[test]
    fn every_example_can_be_typed() {
        fn check(command: &clap::Command) -> usize {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let examples = help.lines().filter(|line| line.starts_with("  haptic-ctl "));
            let mut count = 0;
            for line in examples {
                // What stands behind two spaces, or another program, is no part of it.
                let typed = line.trim().split("  ").next().unwrap_or_default();
                let read = Arguments::try_parse_from(words(typed.split(" | ").next().unwrap_or_default()));
                assert!(read.is_ok(), "{line}: {read:?}");
                assert!(
                    line.contains(command.get_name()),
                    "{line} stands below {}",
                    command.get_name()
                );
                count += 1;
            }
            count + command.get_subcommands().map(check).sum::<usize>()
        }
        assert!(check(&Arguments::command()) >= 15);
    }

    #[test]
    fn every_option_that_takes_a_number_takes_a_negative_one() {
        fn check(command: &clap::Command) -> usize {
            let numbers = command.get_arguments().filter(|argument| {
                let parser = argument.get_value_parser().type_id();
                // Words stand for a number, too.
                let is_free = argument.get_action().takes_values() && argument.get_possible_values().is_empty();
                is_free && parser == std::any::TypeId::of::<f64>()
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
            let line = "haptic-ctl simulate s.toml --motion m.csv --out o.csv --block-velocity";
            let read = Arguments::try_parse_from(words(&format!("{line} {number} --block-position {number}")));
            assert!(read.is_ok(), "{number}: {read:?}");
        }
    }
}
