//! `study plan`: what a study can be made of.

use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_ipc::{quoted, regular_file};
use haptic_studies::plan::{Plan, Task};
use std::path::Path;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml, which is checked
    #[arg(value_name = "PLAN")]
    plan: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let name = &arguments.plan;
    let (plan, text) = read(name)?;
    output::text(text.trim_end())?;
    if built_in(name).is_none() {
        // Beside the plan, which is often written to a file, and below it, where a person sees it.
        eprintln!("{name} is a valid plan: {}", contents(&plan));
        for note in plan.notes() {
            eprintln!("note: {note}");
        }
    }
    Ok(())
}

/// What a subject does by a plan.
fn contents(plan: &Plan) -> String {
    let what = match plan.task() {
        Task::Fitts => "resistance",
        Task::Perception => "test",
    };
    let ends_early = matches!(plan, Plan::Perception(plan) if plan.tests.iter().any(|test| test.staircase.is_some()));
    let most = if ends_early { "at most " } else { "" };
    let trials = plan
        .trials()
        .map(|trials| format!(", {most}{} a subject", output::count(trials as u64, "trial")));
    output::count(plan.ordered_names().len() as u64, what) + &trials.unwrap_or_default()
}

/// The task whose own plan has a name.
fn built_in(name: &str) -> Option<Task> {
    Task::ALL.into_iter().find(|task| task.name() == name)
}

/// Reads and checks a plan: one of the program, or a file.
pub(super) fn read(name: &str) -> Result<(Plan, String), Failure> {
    let text = match built_in(name) {
        Some(task) => task.built_in_plan().to_owned(),
        None => {
            let known = Task::ALL.map(Task::name).join(" and ");
            regular_file::read_text(Path::new(name))
                .map_err(|error| Failure::Usage(format!("{name}: {error}; the program's own plans are {known}")))?
        }
    };
    let plan = Plan::read(&text).map_err(|error| Failure::Usage(format!("{name}: {error}")))?;
    Ok((plan, text))
}

/// The command with which the panel continues a study.
pub(super) fn panel(task: Task, folder: &Path) -> String {
    let page = match task {
        Task::Fitts => "task",
        Task::Perception => "perception",
    };
    format!("haptic-gui --page {page} --study {}", quoted(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_printed_command_is_one_that_a_shell_takes() {
        let of = |folder: &str| panel(Task::Fitts, Path::new(folder));
        assert_eq!(of("study"), "haptic-gui --page task --study study");
        assert_eq!(of("Ada's study"), r"haptic-gui --page task --study 'Ada'\''s study'");
    }

    #[test]
    fn a_checked_plan_says_what_a_subject_does() {
        let text = |name: &str| contents(&read(name).expect("a plan").0);
        assert_eq!(text("fitts"), "5 resistances, 432 trials a subject");
        assert_eq!(text("perception"), "3 tests, at most 400 trials a subject");
    }
}
