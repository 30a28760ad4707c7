//! `study analyse`: what the trials of a study say.

use crate::failure::Failure;
use crate::{output, progress};
use clap::ValueHint;
use haptic_lab::drawing::Table;
use haptic_lab::stats::throughput::Task;
use haptic_studies::analysis::{self, Refusal, Thresholds, Trials};
use haptic_studies::plan::Plan;
use haptic_studies::store::{self, StoreError};
use haptic_studies::subject_table::SubjectTable;
use haptic_studies::trial::{Column, FittsTrial, PerceptionTrial, Trial};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::PathBuf;

pub(super) fn help() -> String {
    format!(
        "A file of trials (CSV, Parquet) has a row a trial. One with the column level_N holds answers of a perception \
         test, any other one trials of the targeting task.\n\n\
         Targeting: {}\n\n\
         Perception: {}\n\n\
         _m is in m, _s in s, _N in N, _hz in Hz. docs/how-to/study.md explains the columns, tables and figures.",
        columns(FittsTrial::COLUMNS),
        columns(PerceptionTrial::COLUMNS)
    )
}

/// The columns that a file must have, and those that it may have.
fn columns(columns: &[Column]) -> String {
    let list = |is_required| {
        let columns = columns.iter().filter(|column| column.is_required == is_required);
        columns.map(|column| column.name).collect::<Vec<_>>().join(", ")
    };
    format!("it must have {}; it may have {}.", list(true), list(false))
}

/// Seed of the intervals: the same trials give the same ones.
const SEED: u64 = 1;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Folder of a study, or a file of trials (CSV or Parquet, a row each)
    #[arg(value_name = "DIR|FILE", value_hint = ValueHint::AnyPath)]
    source: PathBuf,

    /// Each movement begins at a place of its own, not where the last one ended
    #[arg(long)]
    discrete: bool,

    /// Folder for a page, figures (SVG) and tables (CSV, Markdown, LaTeX)
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,

    /// Replace existing files
    #[arg(long, requires = "out")]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let path = &*arguments.source;
    let name = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned();
    let usage = |error: &dyn std::fmt::Display| Failure::Usage(error.to_string());
    let in_source = |error: analysis::AnalysisError| Failure::Usage(format!("{}: {error}", path.display()));
    let is_folder = path.is_dir();
    let read = if is_folder {
        analysis::read_folder(path)
    } else {
        analysis::read_file(path)
    };
    let subjects = if is_folder {
        store::subjects(path).map_err(|error| usage(&error))?
    } else {
        SubjectTable::default()
    };
    // A folder of data need not be a whole study.
    let study = match store::read(path) {
        Ok(study) => Some(study),
        Err(StoreError::NotAStudy(_)) => None,
        Err(error) => return Err(usage(&error)),
    };
    let unfinished = study.as_ref().and_then(|(plan, about)| {
        let (done, of) = store::unfinished(path, plan, about)?;
        // A staircase may end before its last trial.
        let of = of.map_or_else(String::new, |of| format!(" of at most {of}"));
        Some(format!("{done}{of} trials: the study is not finished"))
    });
    let (plan, about) = study.unzip();
    let strangers = |of_trials: BTreeSet<&str>| {
        let of_study = about.as_ref().map(|about| &*about.subjects);
        subjects.strangers(&of_trials, of_study)
    };
    match read.map_err(|error| usage(&error))? {
        Trials::Fitts(trials) => {
            let task = if arguments.discrete {
                Task::Discrete
            } else {
                Task::Serial
            };
            let plan = match &plan {
                Some(Plan::Fitts(plan)) => Some(plan),
                _ => None,
            };
            let baseline = plan.map_or(analysis::BASELINE, |plan| &plan.baseline);
            let mut found = analysis::fitts(&trials, baseline, &Thresholds::PAPER, task).map_err(in_source)?;
            if let Some(plan) = plan {
                found.put_beside_paper(plan);
            }
            found.notes.extend(unfinished);
            found
                .notes
                .extend(strangers(trials.iter().map(|one| &*one.subject).collect()));
            if arguments.out.is_some() {
                let base = if is_folder { path } else { path.parent().unwrap_or(path) };
                let (trajectories, notes) = analysis::trajectories(base, &trials, baseline).map_err(in_source)?;
                found.notes.extend(notes);
                write(arguments, || {
                    analysis::fitts_files(&found, &trajectories, &subjects, &name)
                })?;
            }
            show(
                json,
                &found,
                analysis::fitts_tables(&found, analysis::TERMINAL),
                &found.refused,
                &found.notes,
            )
        }
        Trials::Perception(trials) => {
            let bar = progress::busy("drawing answers for the intervals");
            let plan = match &plan {
                Some(Plan::Perception(plan)) => Some(plan),
                _ => None,
            };
            let mut found = analysis::perception(&trials, plan, SEED).map_err(in_source)?;
            bar.finish_and_clear();
            if let Some(plan) = plan {
                found.put_beside_paper(plan);
            }
            found.notes.extend(unfinished);
            found
                .notes
                .extend(strangers(trials.iter().map(|one| &*one.subject).collect()));
            write(arguments, || analysis::perception_files(&found, &subjects, &name))?;
            show(
                json,
                &found,
                analysis::perception_tables(&found),
                &found.refused,
                &found.notes,
            )
        }
    }
}

/// Writes the files, if they are asked for. None is written where one is in the way.
fn write(arguments: &Arguments, files: impl FnOnce() -> Vec<(String, Vec<u8>)>) -> Result<(), Failure> {
    let Some(folder) = &arguments.out else {
        return Ok(());
    };
    std::fs::create_dir_all(folder).map_err(|error| Failure::not_created(folder, &error))?;
    let files: Vec<(PathBuf, Vec<u8>)> = files()
        .into_iter()
        .map(|(name, bytes)| (folder.join(name), bytes))
        .collect();
    if let Some((path, _)) = files.iter().find(|(path, _)| !arguments.force && path.exists()) {
        return Err(Failure::exists(path));
    }
    for (path, bytes) in files {
        std::fs::write(&path, bytes).map_err(|error| Failure::not_created(&path, &error))?;
    }
    Ok(())
}

fn show(
    json: bool,
    analysis: &impl Serialize,
    tables: Vec<(String, Table)>,
    refused: &[Refusal],
    notes: &[String],
) -> Result<(), Failure> {
    if json {
        return output::json(analysis);
    }
    for (_, table) in tables.into_iter().filter(|(_, table)| table.rows.len() > 1) {
        output::text(&table.caption)?;
        output::line(&format!("{}\n", output::table(&table.rows)))?;
    }
    for Refusal { what, why } in refused {
        output::text(&format!("not found: {what}: {why}"))?;
    }
    for note in notes {
        output::text(&format!("note: {note}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_explains_every_column_of_the_help() {
        let page = include_str!("../../../../docs/how-to/study.md");
        for name in FittsTrial::names().chain(PerceptionTrial::names()) {
            assert!(page.contains(&format!("`{name}`")), "{name}");
            assert!(help().contains(name), "{name}");
        }
    }
}
