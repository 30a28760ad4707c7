//! An example or two for the help of each subcommand.

use clap::Command;

/// Subcommands, and what one could type. Those that are not here have examples among their other help.
const EXAMPLES: &[(&str, &[&str])] = &[
    ("status", &["haptic-ctl status --json", "haptic-ctl --all status"]),
    ("top", &["haptic-ctl top"]),
    ("describe", &["haptic-ctl describe"]),
    ("get", &["haptic-ctl get", "haptic-ctl get mass", "haptic-ctl get @3"]),
    (
        "set",
        &[
            "haptic-ctl set mass=500g Fs=5 --ramp 50ms",
            "haptic-ctl set --by Fs=0.5",
        ],
    ),
    ("undo", &["haptic-ctl undo", "haptic-ctl undo --ramp 200ms"]),
    ("redo", &["haptic-ctl redo"]),
    ("scene", &["haptic-ctl scene load lugre", "haptic-ctl scene save mine"]),
    ("scene list", &["haptic-ctl scene list"]),
    (
        "scene load",
        &[
            "haptic-ctl scene load viscous-drag --ramp 1s",
            "haptic-ctl scene load @3",
        ],
    ),
    ("scene save", &["haptic-ctl scene save mine --replace"]),
    ("scene rename", &["haptic-ctl scene rename mine steel-on-teflon"]),
    ("scene delete", &["haptic-ctl scene delete mine"]),
    (
        "scene diff",
        &["haptic-ctl scene diff lugre", "haptic-ctl scene diff @3 @5"],
    ),
    ("scene show", &["haptic-ctl scene show lugre"]),
    ("schedule", &["haptic-ctl schedule steps.json --name staircase"]),
    (
        "schedule cancel",
        &["haptic-ctl schedule cancel", "haptic-ctl schedule cancel staircase"],
    ),
    ("log", &["haptic-ctl log -n 5", "haptic-ctl events log --past 5"]),
    ("engage", &["haptic-ctl engage --wait"]),
    ("release", &["haptic-ctl release --wait --timeout 2s"]),
    ("stop", &["haptic-ctl stop", "haptic-ctl --all stop"]),
    ("reset", &["haptic-ctl reset"]),
    ("reload", &["haptic-ctl reload"]),
    ("commission", &["haptic-ctl commission"]),
    (
        "identify",
        &[
            "haptic-ctl identify rig.csv --out found.toml",
            "haptic-ctl identify --rig",
        ],
    ),
    (
        "wait",
        &["haptic-ctl wait --until 'state=engaged and device_position_m>1cm' --timeout 5s"],
    ),
    ("recording", &["haptic-ctl recording info rig.mcap"]),
    ("recording info", &["haptic-ctl recording info rig.mcap"]),
    (
        "recording cut",
        &["haptic-ctl recording cut rig.mcap slide.csv --from-marker 1 --to 5s"],
    ),
    (
        "recording collect",
        &["haptic-ctl recording collect set --as left monday.mcap tuesday.mcap"],
    ),
    (
        "recording export",
        &["haptic-ctl recording export rig.mcap rig.parquet"],
    ),
    (
        "recording repair",
        &["haptic-ctl recording repair torn.mcap whole.mcap"],
    ),
    (
        "replay",
        &[
            "haptic-ctl replay rig.mcap",
            "haptic-ctl replay rig.mcap --set Fs=6 --out felt.csv",
        ],
    ),
    ("timing", &["haptic-ctl timing"]),
    (
        "advise",
        &[
            "haptic-ctl advise",
            "haptic-ctl advise high-stiction --at-speed 5mm/s --for-frequency 30Hz",
        ],
    ),
    (
        "devices",
        &["haptic-ctl devices", "haptic-ctl devices --probe serial:/dev/ttyACM0"],
    ),
    ("doctor", &["haptic-ctl doctor"]),
    ("raw", &[r#"haptic-ctl raw '{"op":"get"}'"#]),
    (
        "simulate",
        &["haptic-ctl simulate lugre --motion hand.csv --out felt.csv"],
    ),
    ("accuracy", &["haptic-ctl accuracy"]),
    ("compare", &["haptic-ctl compare real.csv rig.mcap --plot both.svg"]),
    ("surface", &["haptic-ctl surface aluminium-on-teflon --out real.csv"]),
    (
        "study",
        &["haptic-ctl study run fitts --operator simulated --subjects 2 --seed 1 --out study"],
    ),
    (
        "study run",
        &["haptic-ctl study run perception --operator simulated --subjects 2 --seed 1 --out study"],
    ),
    (
        "study analyse",
        &[
            "haptic-ctl study analyse study --out tables",
            "haptic-ctl study analyse trials.csv --json",
        ],
    ),
    (
        "study new",
        &[
            "haptic-ctl study new fitts --subjects 20 --out study",
            "haptic-ctl study new perception --codes P1,P2,P3 --seed 7 --out study",
            "haptic-ctl study new fitts --subjects-file subjects.csv --out study",
        ],
    ),
    ("study resume", &["haptic-ctl study resume study"]),
    ("study plan", &["haptic-ctl study plan fitts"]),
    ("completions", &["haptic-ctl completions bash"]),
    ("man", &["haptic-ctl man ~/.local/share/man/man1"]),
];

/// Puts the examples below the help of their subcommands.
pub(crate) fn add(command: Command) -> Command {
    EXAMPLES.iter().fold(command, |command, (path, examples)| {
        let path: Vec<&str> = path.split(' ').collect();
        add_to(command, &path, examples)
    })
}

fn add_to(command: Command, path: &[&str], examples: &[&str]) -> Command {
    if let [name, rest @ ..] = path {
        return command.mut_subcommand(*name, |subcommand| add_to(subcommand, rest, examples));
    }
    let heading = if examples.len() == 1 { "Example" } else { "Examples" };
    let mut help = format!("{heading}:\n  {}", examples.join("\n  "));
    if let Some(before) = command.get_after_help() {
        help = format!("{before}\n\n{help}");
    }
    help.push_str("\n\nOptions of every subcommand: haptic-ctl --help");
    command.after_help(help)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command_line::Arguments;
    use clap::{CommandFactory, Parser};

    /// The words of a line, as a shell splits it.
    fn words(line: &str) -> Vec<String> {
        let quoted = line.split('\'').enumerate();
        let parts = quoted.flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        });
        parts.collect()
    }

    fn check(command: &Command, path: &str) -> usize {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        assert!(
            help.contains(&format!("haptic-ctl {path}")),
            "`{path}` has no example: {help}"
        );
        let nested = command
            .get_subcommands()
            .filter(|nested| !nested.is_hide_set() && nested.get_name() != "help");
        1 + nested
            .map(|nested| check(nested, &format!("{path} {}", nested.get_name())))
            .sum::<usize>()
    }

    #[test]
    fn every_subcommand_has_an_example_and_each_can_be_typed() {
        let command = add(Arguments::command());
        let all = command.get_subcommands().filter(|command| !command.is_hide_set());
        assert!(all.map(|command| check(command, command.get_name())).sum::<usize>() > 40);
        for line in EXAMPLES.iter().flat_map(|(_, examples)| *examples) {
            let read = Arguments::try_parse_from(words(line));
            assert!(read.is_ok(), "{line}: {read:?}");
        }
    }
}
