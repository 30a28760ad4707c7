//! `study new`: a study for people.

use super::plan;
use super::run::not_stored;
use crate::failure::Failure;
use crate::output;
use clap::{Args, ValueHint};
use haptic_studies::store::{Study, StudyDescription};
use haptic_studies::subject::numbered_codes;
use serde_json::json;
use std::path::PathBuf;

pub(super) const HELP: &str = "\
Continue in the panel: `haptic-gui --page task --study DIR` for targets, `haptic-gui --page perception --study DIR` for surfaces. Subjects are codes \
of letters and digits; keep the list that ties them to people elsewhere.";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml (`haptic-ctl study plan fitts` prints one)
    #[arg(value_name = "PLAN")]
    plan: String,

    /// Folder of the study, which must not exist, or be empty
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: PathBuf,

    /// Number of subjects, from 1 to 999; their codes are 01, 02, ...
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=999))]
    #[arg(required_unless_present = "codes", conflicts_with = "codes")]
    subjects: Option<u32>,

    /// Codes of the subjects, as in --codes P1,P2,P3
    #[arg(long, value_name = "CODE,...", value_delimiter = ',')]
    codes: Vec<String>,

    /// Seed of all random orders
    #[arg(long, value_name = "S", default_value = "1")]
    seed: u64,
}

pub(super) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let (plan, text) = plan::read(&arguments.plan)?;
    let codes = arguments
        .subjects
        .map_or_else(|| arguments.codes.clone(), numbered_codes);
    let about = StudyDescription::people(&plan, &text, arguments.seed, codes);
    let study = Study::create(&arguments.out, &text, &about).map_err(not_stored)?;
    if as_json {
        return output::json(&json!({
            "folder": study.folder(),
            "operator": about.operator,
            "subjects": about.subjects,
            "seed": about.seed,
        }));
    }
    output::text(&format!(
        "{}: a study for people: {}. Continue with `{}`.",
        study.folder().display(),
        about.subjects.join(", "),
        plan::panel(about.task, study.folder())
    ))
}
