//! `study plan`: what a study can be made of.

use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_ipc::regular_file;
use haptic_studies::plan::{Plan, Task};
use std::path::Path;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml, which is checked
    #[arg(value_name = "PLAN")]
    plan: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (_, text) = read(&arguments.plan)?;
    output::text(text.trim_end())
}

/// Reads and checks a plan: one of the program, or a file.
pub(super) fn read(name: &str) -> Result<(Plan, String), Failure> {
    let built_in = Task::ALL.into_iter().find(|task| task.name() == name);
    let text = match built_in {
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
    format!("haptic-gui --page {page} --study {}", folder.display())
}
