//! `completions`: what makes a shell complete haptic-ctl.

use crate::failure::Failure;
use clap_complete::env::{Bash, EnvCompleter, Fish, Zsh};
use std::io::Write;

/// Where the shell is told to look: see [`clap_complete::CompleteEnv`].
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

pub(crate) fn run(shell: Shell) -> Result<(), Failure> {
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
