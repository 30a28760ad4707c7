//! Commands that a text advises, in backticks or as an example of the help: they are for the rig that the command line
//! names.

use crate::words;
use haptic_ipc::quoted;
use haptic_ipc::socket_path::{NamedSocket, is_rig_name};
use std::borrow::Cow;
use std::ffi::OsString;
use std::sync::OnceLock;

/// The options by which the command line names its rig.
static OPTIONS: OnceLock<String> = OnceLock::new();

/// Subcommands that ask no rig.
const OFFLINE: [&str; 7] = [
    "accuracy",
    "compare",
    "completions",
    "devices",
    "man",
    "recording",
    "study",
];

/// Takes the rig that a command line names, in order, once.
pub(crate) fn choose(words: &[OsString]) {
    if let Some(options) = words::options_of_rig(words) {
        OPTIONS.get_or_init(|| options);
    }
}

/// The text, whose commands are for the rig that the command line names.
pub(crate) fn addressed(text: &str) -> Cow<'_, str> {
    OPTIONS
        .get()
        .map_or(Cow::Borrowed(text), |options| with_options(text, options).into())
}

/// The text, whose commands are for the rig of a socket.
pub(crate) fn for_rig(text: &str, rig: &NamedSocket) -> String {
    let options = match is_rig_name(&rig.name) {
        true => format!("--rig {}", rig.name),
        false => format!("--socket {}", quoted(&rig.path)),
    };
    with_options(text, &options)
}

/// The text, whose commands have these options. Those with options before the subcommand stay as they are.
fn with_options(text: &str, options: &str) -> String {
    let mut addressed = text.to_owned();
    for begin in ["`haptic-ctl ", "\n  haptic-ctl "] {
        let mut parts = addressed.split(begin);
        let mut joined = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let end = part.find(|letter: char| !letter.is_ascii_lowercase());
            let subcommand = end.map_or(part, |end| &part[..end]);
            let is_offline = subcommand.is_empty() || OFFLINE.contains(&subcommand);
            let option = if is_offline {
                String::new()
            } else {
                format!("{options} ")
            };
            joined += &format!("{begin}{option}{part}");
        }
        addressed = joined;
    }
    addressed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command_line::Arguments;
    use clap::CommandFactory;

    #[test]
    fn advised_commands_are_for_the_rig_that_is_named() {
        for (text, expected) in [
            (
                "run `haptic-ctl reset`, or `haptic-ctl identify --rig`",
                "run `haptic-ctl --rig left reset`, or `haptic-ctl --rig left identify --rig`",
            ),
            (
                "Examples:\n  haptic-ctl set mass=1\n  haptic-ctl get",
                "Examples:\n  haptic-ctl --rig left set mass=1\n  haptic-ctl --rig left get",
            ),
            ("`haptic-ctl study resume DIR`", "`haptic-ctl study resume DIR`"),
            ("`haptic-ctl --all status`", "`haptic-ctl --all status`"),
            ("haptic-ctl waits; haptic-ctl: no", "haptic-ctl waits; haptic-ctl: no"),
        ] {
            let addressed = with_options(text, "--rig left");
            assert_eq!(addressed, expected);
            assert_eq!(
                with_options(&addressed, "--rig right"),
                expected,
                "a command has one rig"
            );
        }
    }

    #[test]
    fn subcommands_that_ask_no_rig_exist() {
        let commands = Arguments::command();
        for name in OFFLINE {
            assert!(commands.find_subcommand(name).is_some(), "{name}");
        }
    }
}
