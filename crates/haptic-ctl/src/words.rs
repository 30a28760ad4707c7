//! The words of the command line before they are parsed: which rig is meant may stand anywhere, and whoever types
//! `stop` means a stop, whatever else is wrong. And how a line ends that cannot be parsed.

use crate::failure::Failure;
use clap::Command;
use clap::error::{ContextKind, ContextValue};
use haptic_ipc::quoted;
use haptic_ipc::socket_path::is_rig_name;
use std::ffi::OsString;
use std::process::ExitCode;

/// Options of the whole line that take a value, and stand before or behind the subcommand.
const WITH_VALUE: [&str; 2] = ["--socket", "--rig"];

/// Puts `--rig NAME`, `--socket PATH` and `--all` before the subcommand, wherever they stand. Behind `--`, and in the command of
/// `lease`, the words are another program's; `identify --rig` is an option of its own, and only `--rig=NAME` names a
/// rig there.
pub(crate) fn in_order(words: Vec<OsString>) -> Vec<OsString> {
    let mut words = words.into_iter();
    let mut before: Vec<OsString> = words.next().into_iter().collect();
    let mut rest: Vec<OsString> = Vec::new();
    let mut subcommand: Option<String> = None;
    let mut is_foreign = false;
    while let Some(word) = words.next() {
        let text = word.to_string_lossy().into_owned();
        let in_identify = subcommand.as_deref() == Some("identify");
        is_foreign |= text == "--";
        if is_foreign {
            rest.push(word);
        } else if text == "--all" || text.starts_with("--rig=") || text.starts_with("--socket=") {
            before.push(word);
        } else if text == "--rig" && !in_identify || text == "--socket" {
            before.push(word);
            before.extend(words.next());
        } else {
            if !text.starts_with('-') {
                is_foreign = subcommand.as_deref() == Some("lease");
                subcommand.get_or_insert(text);
            }
            rest.push(word);
        }
    }
    before.extend(rest);
    before
}

/// The options by which a line in order names one rig: they come first.
pub(crate) fn options_of_rig(words: &[OsString]) -> Option<String> {
    let mut words = words.iter().skip(1).map(|word| word.to_string_lossy());
    let word = words.next()?;
    let (option, value) = match word.split_once('=') {
        Some((option, value)) => (option, value.into()),
        None => (&*word, words.next()?),
    };
    match option {
        "--rig" if is_rig_name(&value) => Some(format!("--rig {value}")),
        "--socket" => Some(format!("--socket {}", quoted(&*value))),
        _ => None,
    }
}

/// Whether a line that cannot be parsed means a stop: `stop` is its subcommand, or stands where none is.
pub(crate) fn mean_a_stop(words: &[OsString], commands: &Command) -> bool {
    let words: Vec<String> = words
        .iter()
        .skip(1)
        .map(|word| word.to_string_lossy().into_owned())
        .take_while(|word| word != "--")
        .collect();
    let mut plain = Vec::new();
    let mut is_value = false;
    for word in &words {
        if !is_value && !word.starts_with('-') {
            plain.push(word.as_str());
        }
        is_value = WITH_VALUE.contains(&word.as_str());
    }
    let is_other = plain
        .first()
        .is_some_and(|word| *word != "stop" && commands.find_subcommand(word).is_some());
    !is_other && words.iter().any(|word| word == "stop")
}

/// Names the subcommands of others that an unknown subcommand is called like, as in `scene load` for `load`.
pub(crate) fn suggest(error: &mut clap::Error, commands: &Command) {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else {
        return;
    };
    let groups = commands.get_subcommands().filter(|group| !group.is_hide_set());
    let meant = groups.filter_map(|group| Some((group, group.find_subcommand(word)?)));
    let meant: Vec<String> = meant
        .map(|(group, one)| format!("{} {}", group.get_name(), one.get_name()))
        .collect();
    if !meant.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(meant));
    }
}

/// Ends with an error of the command line, or with its help.
pub(crate) fn end(error: &clap::Error) -> ExitCode {
    if wants_json() && error.use_stderr() {
        return Failure::Usage(error_text(error)).report(true);
    }
    error.exit()
}

/// Whether JSON is wanted, on a line that cannot be parsed.
pub(crate) fn wants_json() -> bool {
    std::env::args()
        .take_while(|word| word != "--")
        .any(|word| word == "--json")
}

/// The error alone, without the summary of the options below it.
pub(crate) fn error_text(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let text = text.split("\n\nUsage:").next().unwrap_or(&text);
    let text = text.split("\n\nFor more information").next().unwrap_or(text);
    text.trim_start_matches("error: ").trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command_line::Arguments;
    use clap::CommandFactory;

    fn split(line: &str) -> Vec<OsString> {
        line.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn the_rig_may_be_named_anywhere_on_the_line() {
        for (given, ordered) in [
            ("c stop --all", "c --all stop"),
            ("c stop --rig left", "c --rig left stop"),
            ("c set Fs=3 --rig=left --json", "c --rig=left set Fs=3 --json"),
            ("c --socket --rig stop", "c --socket --rig stop"),
            ("c identify --rig", "c identify --rig"),
            ("c identify --rig --rig=left", "c --rig=left identify --rig"),
            ("c --rig left identify --rig", "c --rig left identify --rig"),
            ("c lease --rig left make --all", "c --rig left lease make --all"),
            ("c lease -- make --all", "c lease -- make --all"),
            ("c stop --rig", "c --rig stop"),
        ] {
            assert_eq!(in_order(split(given)), split(ordered), "{given}");
        }
    }

    #[test]
    fn one_rig_has_the_options_by_which_it_was_named() {
        for (given, options) in [
            ("c stop --rig left", Some("--rig left")),
            ("c --rig=left set Fs=3", Some("--rig left")),
            ("c status --socket a/b", Some("--socket a/b")),
            ("c --socket=a'b status", Some("--socket 'a'\\''b'")),
            ("c --rig a/b status", None),
            ("c stop --all --socket a/b", None),
            ("c identify --rig", None),
            ("c lease -- c --socket a/b", None),
            ("c status", None),
        ] {
            let options_of = options_of_rig(&in_order(split(given)));
            assert_eq!(options_of.as_deref(), options, "{given}");
        }
    }

    #[test]
    fn word_of_a_group_is_taken_for_its_subcommand() {
        for (line, tip) in [
            ("c load mine", "a similar subcommand exists: 'scene load'"),
            ("c run fitts", "a similar subcommand exists: 'study run'"),
            ("c scene info", "a similar subcommand exists: 'recording info'"),
            ("c stauts", "'study', 'status'"),
            ("c scene lod", "'load'"),
        ] {
            let mut error = Arguments::command().try_get_matches_from(split(line)).expect_err(line);
            suggest(&mut error, &Arguments::command());
            assert!(error_text(&error).contains(tip), "{line}: {}", error_text(&error));
        }
    }

    // hazard: H26
    #[test]
    fn whoever_types_stop_means_a_stop() {
        for (line, means) in [
            ("c stop now", true),
            ("c stop --hard", true),
            ("c --rig", false),
            ("c --rig stop", true),
            ("c --colour stop", true),
            ("c everything stop", true),
            ("c scene load stop --wrong", false),
            ("c lease -- stop", false),
            ("c set stop=1", false),
        ] {
            assert_eq!(mean_a_stop(&split(line), &Arguments::command()), means, "{line}");
        }
    }
}
