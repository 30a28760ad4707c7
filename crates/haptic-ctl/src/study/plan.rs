//! `study plan` and `study operator`: what a study can be made of.

use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_ipc::regular_file;
use haptic_studies::operator::Constants;
use haptic_studies::plan::{Plan, Task};
use serde_json::json;
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

/// Lists the constants of the simulated operator.
pub(crate) fn operator(as_json: bool) -> Result<(), Failure> {
    if as_json {
        let constants = Constants::ALL.iter().map(|constant| {
            json!({
                "name": constant.name,
                "usual": constant.usual,
                "low": constant.low,
                "high": constant.high,
                "source": constant.source,
            })
        });
        return output::json(&json!({ "constants": constants.collect::<Vec<_>>() }));
    }
    for constant in Constants::ALL {
        output::text(&format!(
            "{:<24} {:>6}   {} to {}   {}",
            constant.name, constant.usual, constant.low, constant.high, constant.source
        ))?;
    }
    Ok(())
}
