//! `study new`: a study for people.

use super::plan;
use super::run::not_stored;
use super::subjects::Subjects;
use crate::failure::Failure;
use crate::output;
use clap::{Args, ValueHint};
use haptic_ipc::quoted;
use haptic_studies::order::{Order, rows};
use haptic_studies::plan::Plan;
use haptic_studies::store::{Study, StudyDescription};
use haptic_studies::trial::Operator;
use serde_json::json;
use std::path::PathBuf;

pub(super) const HELP: &str = "\
Continue in the panel: `haptic-gui --page task --study DIR`, or `--page perception` for surfaces.

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
    let about = StudyDescription::people(&plan, &text, arguments.seed, &subjects);
    let study = Study::create(&arguments.out, &text, &about, &subjects).map_err(not_stored)?;
    show(&study, as_json)
}

/// Shows who takes part, each in which order, and how the study continues.
pub(super) fn show(study: &Study, as_json: bool) -> Result<(), Failure> {
    let (plan, about) = (study.plan(), study.about());
    let orders = about.all_subjects().map(|subject| plan.order_of(about.seed, &subject));
    let orders: Vec<Vec<String>> = orders.collect();
    if as_json {
        return output::json(&json!({
            "folder": study.folder(),
            "operator": about.operator,
            "subjects": about.subjects,
            "orders": orders,
            "seed": about.seed,
        }));
    }
    let (who, next) = match about.operator {
        Operator::Human => ("for people", plan::panel(about.task, study.folder())),
        Operator::Simulated => {
            let resume = format!("haptic-ctl study resume {}", quoted(study.folder()));
            ("by simulated operators", resume)
        }
    };
    output::text(&format!(
        "{}: a study {who}: {}. Continue with `{next}`.",
        study.folder().display(),
        about.subjects.join(", ")
    ))?;
    for (code, order) in about.subjects.iter().zip(&orders) {
        output::text(&format!("{code}: {}", order.join(" | ")))?;
    }
    say_notes(plan, about)
}

/// Says what of the plan may be meant otherwise, and where a Latin square is not balanced, with so many subjects or
/// with orders that a table gave.
pub(super) fn say_notes(plan: &Plan, about: &StudyDescription) -> Result<(), Failure> {
    for note in plan.notes() {
        output::text(&format!("note: {note}"))?;
    }
    let square = (plan.order() == Order::LatinSquare).then(|| plan.ordered_names().len());
    let given = about.orders.iter().filter(|order| !order.is_empty()).count();
    let note = square.and_then(|things| unbalanced(things, about.subjects.len(), given));
    note.map_or(Ok(()), |note| output::text(&note))
}

/// What unbalances a square of so many things, done by so many subjects, some of whom have an order of their own.
/// Nothing does where all have one.
fn unbalanced(things: usize, count: usize, given: usize) -> Option<String> {
    let rows = rows(things);
    let why = match given {
        _ if given == count => return None,
        0 if count.is_multiple_of(rows) => return None,
        0 => format!("there are {count}"),
        _ => format!("the table gives {given} of {count} an order of their own, which breaks it"),
    };
    Some(format!(
        "note: the Latin square of {things} is balanced with {rows} subjects, or a multiple of that; {why}"
    ))
}

#[cfg(test)]
mod tests {
    use super::unbalanced;

    #[test]
    fn a_note_says_what_unbalances_a_square() {
        let note = |count, given| unbalanced(3, count, given).unwrap_or_default();
        let square = "note: the Latin square of 3 is balanced with 6 subjects, or a multiple of that; ";
        assert_eq!(note(4, 0), format!("{square}there are 4"));
        let broken = "the table gives 1 of 6 an order of their own, which breaks it";
        assert_eq!(note(6, 1), format!("{square}{broken}"));
        assert_eq!((note(6, 0), note(12, 0), note(2, 2)), Default::default());
    }
}
