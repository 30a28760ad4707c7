//! `study new`: a study for people.

use super::plan;
use super::run::not_stored;
use super::subjects::Subjects;
use crate::failure::Failure;
use crate::output;
use clap::{Args, ValueHint};
use haptic_studies::order::{Order, rows};
use haptic_studies::plan::Plan;
use haptic_studies::store::{Study, StudyDescription};
use serde_json::json;
use std::path::PathBuf;

pub(super) const HELP: &str = "\
Continue in the panel: `haptic-gui --page task --study DIR`, or `--page perception` for surfaces. Keep the list that \
ties codes to people elsewhere.

Example:
  haptic-ctl study new perception --codes P1,P2,P3 --seed 7 --out study";

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml (`study plan fitts` prints one)
    #[arg(value_name = "PLAN")]
    plan: String,

    /// Folder of the study, new or empty
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: PathBuf,

    #[command(flatten)]
    subjects: Subjects,

    /// Seed of all random orders
    #[arg(long, value_name = "S", default_value = "1")]
    seed: u64,
}

pub(super) fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let (plan, text) = plan::read(&arguments.plan)?;
    let subjects = arguments.subjects.table()?;
    let about = StudyDescription::people_of(&plan, &text, arguments.seed, &subjects);
    let study = Study::create_for(&arguments.out, &text, &about, &subjects).map_err(not_stored)?;
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
    ))?;
    say_unbalanced(&plan, &about)
}

/// Says where a Latin square is not balanced with so many subjects.
pub(super) fn say_unbalanced(plan: &Plan, about: &StudyDescription) -> Result<(), Failure> {
    let (things, count) = (plan.ordered_names().len(), about.subjects.len());
    let rows = rows(things);
    if plan.order() == Order::LatinSquare && about.orders.is_empty() && !count.is_multiple_of(rows) {
        output::text(&format!(
            "note: the Latin square of {things} is balanced with {rows} subjects, or a multiple of that; there are {count}"
        ))?;
    }
    Ok(())
}
