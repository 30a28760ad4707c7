//! `man`: the manual pages, from the same text as --help.

use crate::failure::Failure;
use crate::output;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Directory for the pages, one for each subcommand
    directory: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, command: clap::Command) -> Result<(), Failure> {
    let directory = &arguments.directory;
    let failed = |error: std::io::Error| Failure::File(format!("{}: {error}", directory.display()));
    std::fs::create_dir_all(directory).map_err(failed)?;
    clap_mangen::generate_to(command.disable_help_subcommand(true), directory).map_err(failed)?;
    output::line(&format!(
        "{0}: read one with `man -l {0}/haptic-ctl.1`",
        directory.display()
    ))
}
