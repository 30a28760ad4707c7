//! A command line that cannot be understood.

use crate::failure::Failure;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command};
use haptic_core::nearest::nearest;
use std::process::ExitCode;

/// Ends with an error of the command line, or with its help.
pub(crate) fn end(mut error: clap::Error, commands: &Command) -> ExitCode {
    // After `--` stands the command line of another program.
    let words: Vec<String> = std::env::args_os()
        .take_while(|word| word != "--")
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    guess(&mut error, commands, &words);
    if wants_json() && error.use_stderr() {
        return Failure::Usage(text(&error)).report(true);
    }
    error.exit()
}

/// Whether JSON is wanted, on a line that cannot be parsed.
pub(crate) fn wants_json() -> bool {
    std::env::args()
        .take_while(|word| word != "--")
        .any(|word| word == "--json")
}

/// Names the subcommand or option that an unknown one was probably meant to be, also where another word for it says so;
/// none that is merely spelt a little alike.
fn guess(error: &mut clap::Error, commands: &Command, words: &[String]) {
    let (wrong, suggested) = match error.kind() {
        ErrorKind::InvalidSubcommand => (ContextKind::InvalidSubcommand, ContextKind::SuggestedSubcommand),
        ErrorKind::UnknownArgument => (ContextKind::InvalidArg, ContextKind::SuggestedArg),
        _ => return,
    };
    let Some(ContextValue::String(wrong)) = error.get(wrong) else {
        return;
    };
    let mut command = commands;
    for word in words.iter().take_while(|word| *word != wrong) {
        command = command.find_subcommand(word).unwrap_or(command);
    }
    let meant = match wrong.strip_prefix("--") {
        Some(wrong) => {
            let known: Vec<&str> = command.get_arguments().filter_map(Arg::get_long).collect();
            nearest(wrong, &known).map(|meant| ContextValue::String(format!("--{meant}")))
        }
        None => {
            let known: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            nearest(wrong, &known).map(|meant| ContextValue::Strings(vec![meant.to_owned()]))
        }
    };
    match meant {
        Some(meant) => error.insert(suggested, meant),
        None => error.remove(suggested),
    };
}

/// The error alone, without the summary of the options below it.
pub(crate) fn text(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let text = text.split("\n\nUsage:").next().unwrap_or(&text);
    let text = text.split("\n\nFor more information").next().unwrap_or(text);
    text.trim_start_matches("error: ").trim().to_owned()
}
