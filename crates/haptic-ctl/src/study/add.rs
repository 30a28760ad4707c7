//! `study add`: more subjects for a study that there is.

use super::new;
use super::run::not_stored;
use super::subjects::Subjects;
use crate::failure::Failure;
use clap::{Args, ValueHint};
use haptic_studies::store::Study;
use std::path::PathBuf;

pub(super) const HELP: &str = "\
--subjects is the number that the study then has; --codes and --subjects-file name the new subjects alone. They come \
after the others, in the orders that they would have had from the start. The others keep all that they have.

Example:
  haptic-ctl study add study --codes P4,P5";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Folder of the study
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    folder: PathBuf,

    #[command(flatten)]
    subjects: Subjects,
}

pub(super) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let mut study = Study::open(&arguments.folder).map_err(not_stored)?;
    let subjects = arguments.subjects.new_ones(study.about())?;
    study.add(&subjects).map_err(not_stored)?;
    new::show(&study, as_json)
}
