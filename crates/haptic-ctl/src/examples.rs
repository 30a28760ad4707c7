//! Lines that one could type, for the help of subcommands whose options do not speak for themselves.

use clap::Command;

/// Subcommands and their examples. Some have examples among their other help.
const EXAMPLES: &[(&str, &[&str])] = &[
    ("status", &["haptic-ctl status --json", "haptic-ctl --all status"]),
    ("describe", &["haptic-ctl describe", "haptic-ctl describe lugre"]),
    ("get", &["haptic-ctl get", "haptic-ctl get mass", "haptic-ctl get @3"]),
    (
        "set",
        &[
            "haptic-ctl set mass=500g Fs=5 --ramp 50ms",
            "haptic-ctl set --by Fs=0.5",
        ],
    ),
    ("undo", &["haptic-ctl undo --ramp 200ms"]),
    ("scene", &["haptic-ctl scene load lugre", "haptic-ctl scene save mine"]),
    (
        "scene load",
        &[
            "haptic-ctl scene load viscous-drag --ramp 1s",
            "haptic-ctl scene load @3",
        ],
    ),
    ("scene save", &["haptic-ctl scene save mine --replace"]),
    ("scene rename", &["haptic-ctl scene rename mine steel-on-teflon"]),
    (
        "scene diff",
        &["haptic-ctl scene diff lugre", "haptic-ctl scene diff @3 @5"],
    ),
    ("schedule", &["haptic-ctl schedule steps.json --name staircase"]),
    ("engage", &["haptic-ctl engage --wait"]),
    ("release", &["haptic-ctl release --wait --timeout 2s"]),
    ("stop", &["haptic-ctl stop", "haptic-ctl --all stop"]),
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
    (
        "advise",
        &["haptic-ctl advise high-stiction --at-speed 5mm/s --for-frequency 30Hz"],
    ),
    ("devices", &["haptic-ctl devices --probe serial:/dev/ttyACM0"]),
    ("raw", &[r#"haptic-ctl raw '{"op":"get"}'"#]),
    (
        "simulate",
        &["haptic-ctl simulate lugre --motion hand.csv --out felt.csv"],
    ),
    ("compare", &["haptic-ctl compare real.csv rig.mcap --plot both.svg"]),
    ("surface", &["haptic-ctl surface aluminium-on-teflon --out real.csv"]),
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
];

/// Puts the examples below the help of their subcommands.
pub(crate) fn add(command: Command) -> Command {
    EXAMPLES.iter().fold(command, |command, (path, examples)| {
        let path: Vec<&str> = path.split(' ').collect();
        let heading = if examples.len() == 1 { "Example" } else { "Examples" };
        add_to(command, &path, &format!("{heading}:\n  {}", examples.join("\n  ")))
    })
}

fn add_to(command: Command, path: &[&str], text: &str) -> Command {
    if let [name, rest @ ..] = path {
        return command.mut_subcommand(*name, |subcommand| add_to(subcommand, rest, text));
    }
    below(command, text)
}

/// Puts a text below the help of a command.
pub(crate) fn below(command: Command, text: &str) -> Command {
    let before = command.get_after_help().map(|before| format!("{before}\n\n"));
    command.after_help(before.unwrap_or_default() + text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command_line::Arguments;
    use clap::Parser;

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
        for (path, examples) in EXAMPLES {
            for line in *examples {
                let read = Arguments::try_parse_from(words(line));
                assert!(read.is_ok(), "{line}: {read:?}");
                let last = path.split(' ').next_back().expect("a name");
                assert!(line.contains(last), "{line} stands below {path}");
            }
        }
    }
}
