//! What is made from the command line: the completions of a shell, and the manual pages of a package.

use crate::failure::Failure;
use crate::output;
use clap_complete::env::{Bash, EnvCompleter, Fish, Zsh};
use haptic_ipc::quoted;
use std::io::Write;
use std::path::Path;

/// The variable by which the shell asks for completions: see [`clap_complete::CompleteEnv`].
const VARIABLE: &str = "COMPLETE";

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Shell {
    /// Put `source <(haptic-ctl completions bash)` into ~/.bashrc
    Bash,
    /// Put `source <(haptic-ctl completions zsh)` into ~/.zshrc, after compinit
    Zsh,
    /// Run `haptic-ctl completions fish > ~/.config/fish/completions/haptic-ctl.fish`
    Fish,
}

pub(crate) fn completions(shell: Shell) -> Result<(), Failure> {
    let completer: &dyn EnvCompleter = match shell {
        Shell::Bash => &Bash,
        Shell::Zsh => &Zsh,
        Shell::Fish => &Fish,
    };
    let mut script = Vec::new();
    completer.write_registration(VARIABLE, "haptic-ctl", "haptic-ctl", "haptic-ctl", &mut script)?;
    let mut out = std::io::stdout().lock();
    out.write_all(&script)?;
    Ok(out.flush()?)
}

/// Writes a manual page for each subcommand into a folder.
pub(crate) fn manual(folder: &Path, command: clap::Command) -> Result<(), Failure> {
    let failed = |error: std::io::Error| Failure::File(format!("{}: {error}", folder.display()));
    std::fs::create_dir_all(folder).map_err(failed)?;
    // A page has the whole help.
    let command = command.mut_args(|option| option.hide_short_help(false));
    clap_mangen::generate_to(command.disable_help_subcommand(true), folder).map_err(failed)?;
    output::unless_quiet(&format!(
        "{}: read one with `man -l {}`",
        folder.display(),
        quoted(folder.join("haptic-ctl.1"))
    ))
}
