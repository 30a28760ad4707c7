//! `study run` and `study resume`: a study by simulated operators.

use super::plan;
use super::subjects::Subjects;
use crate::console::Signals;
use crate::failure::Failure;
use crate::{output, progress};
use clap::{Args, ValueEnum};
use haptic_ipc::quoted;
use haptic_studies::operator;
use haptic_studies::pace::time_left;
use haptic_studies::plan::Plan;
use haptic_studies::run::{self, Progress, RunError};
use haptic_studies::store::{StoreError, Study, StudyDescription};
use haptic_studies::trial;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

pub(super) const HELP: &str = "\
An interrupt ends the study after the trials under way. `haptic-ctl study resume DIR` continues it, also after a \
crash.

Example:
  haptic-ctl study run perception --operator simulated --subjects 2 --out study";

/// Who takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Operator {
    /// A model of a person
    Simulated,
}

// The operator is needed; without one the refusal says how people do the study.
#[derive(Debug, Args)]
#[command(override_usage = "haptic-ctl study run [OPTIONS] --operator <WHO> --out <DIR> \
    <--subjects <N>|--codes <CODE,...>|--subjects-file <FILE>> <PLAN>")]
pub(crate) struct Arguments {
    /// Plan: fitts, perception, or a PLAN.toml (`study plan fitts` prints one)
    #[arg(value_name = "PLAN")]
    plan: String,

    /// Who takes part
    #[arg(long, value_name = "WHO")]
    operator: Option<Operator>,

    #[command(flatten)]
    subjects: Subjects,

    /// Seed of all random orders, and of the operators' noise
    #[arg(long, value_name = "S", default_value = "1")]
    seed: u64,

    /// Folder of the study, new or empty
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Keep the rows alone, not every tick (200 kB a second)
    #[arg(long)]
    no_recordings: bool,
}

pub(crate) async fn run(arguments: &Arguments, as_json: bool) -> Result<(), Failure> {
    let (plan, text) = plan::read(&arguments.plan)?;
    if arguments.operator.is_none() {
        return Err(Failure::Usage(format!(
            "--operator simulated is needed: people do a study in the panel; `haptic-ctl study new {} {} --out {}` makes \
             it; continue with `{}`",
            quoted(&arguments.plan),
            arguments.subjects,
            quoted(&arguments.out),
            plan::panel(plan.task(), &arguments.out)
        )));
    }
    let recordings = !arguments.no_recordings;
    let subjects = arguments.subjects.table()?;
    let about = StudyDescription::simulated(&plan, &text, arguments.seed, &subjects, recordings);
    let study = Study::create(&arguments.out, &text, &about, &subjects).map_err(not_stored)?;
    if !as_json {
        super::new::say_notes(&plan, &about)?;
    }
    go_on(study, &arguments.out, as_json).await
}

pub(crate) async fn resume(folder: &Path, as_json: bool) -> Result<(), Failure> {
    let study = Study::open(folder).map_err(not_stored)?;
    if study.about().operator == trial::Operator::Human {
        return people(&study, as_json);
    }
    go_on(study, folder, as_json).await
}

/// The folder that was named is wrong usage, but for a disk that fails.
pub(super) fn not_stored(error: StoreError) -> Failure {
    match error {
        StoreError::File { path, source } => Failure::not_created(&path, &source),
        error => Failure::Usage(error.to_string()),
    }
}

/// Shows how far people are, and puts all trials that are done into one file.
fn people(study: &Study, as_json: bool) -> Result<(), Failure> {
    let mut subjects = Vec::new();
    for subject in study.subjects() {
        let (done, of) = study.progress(&subject).map_err(not_stored)?;
        subjects.push((subject.code, done, of));
    }
    let all = study.collect().map_err(not_stored)?;
    if as_json {
        let subjects = subjects
            .iter()
            .map(|(code, done, of)| json!({ "subject": code, "trials": done, "of": of }));
        return output::json(&json!({
            "folder": study.folder(),
            "operator": "human",
            "subjects": subjects.collect::<Vec<_>>(),
            "trials_file": all,
        }));
    }
    for (code, done, of) in &subjects {
        let of = of.map_or_else(String::new, |of| format!(" of {of}"));
        output::text(&format!("subject {code}: {done}{of} trials, practice included"))?;
    }
    output::text(&format!(
        "{}: people do this study: continue with `{}`.",
        study.folder().display(),
        plan::panel(study.about().task, study.folder())
    ))?;
    all.map_or(Ok(()), |all| {
        output::text(&format!("All trials so far: {}", all.display()))
    })
}

/// Runs what is left of a study.
async fn go_on(study: Study, folder: &Path, as_json: bool) -> Result<(), Failure> {
    let subjects = study.about().subjects.len();
    let trials = trials(&study)?;
    let extent = trials.and_then(|(done, of)| extent(study.plan(), of - done));
    if let Some(extent) = extent.filter(|_| !as_json && !output::is_quiet()) {
        output::text(&format!("{}, operator: simulated: {extent}", folder.display()))?;
    }
    let progress = Arc::new(Progress::default());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut signals = Signals::new()?;
    let began = Instant::now();
    let watched = Arc::clone(&progress);
    let mut work = tokio::task::spawn_blocking(move || run::run(&study, threads, &watched));
    let bar = progress::steps(trials.map_or(subjects, |(_, of)| of));
    let mut shown = tokio::time::interval(Duration::from_millis(100));
    let result = loop {
        tokio::select! {
            ended = &mut work => break ended,
            _ = shown.tick() => {
                let position = trials.map_or(progress.subjects(), |(before, _)| before + progress.trials());
                bar.set_position(position as u64);
                bar.set_message(under_way(trials, &progress, subjects, began.elapsed().as_secs_f64()));
            }
            _ = signals.next() => progress.stop(),
        }
    };
    bar.finish_and_clear();
    let result = result.map_err(|error| Failure::File(error.to_string()))?;
    result.map_err(not_run)?;
    let took_s = began.elapsed().as_secs_f64();
    let is_finished = progress.subjects() == subjects;
    report(&progress, folder, is_finished, took_s, as_json)?;
    if is_finished { Ok(()) } else { Err(Failure::Interrupted) }
}

/// Trials that all subjects have done, and trials in all; none where a staircase has no such number.
fn trials(study: &Study) -> Result<Option<(usize, usize)>, Failure> {
    let mut sum = (0, 0);
    for subject in study.subjects() {
        let (done, Some(of)) = study.progress(&subject).map_err(not_stored)? else {
            return Ok(None);
        };
        sum = (sum.0 + done, sum.1 + of);
    }
    Ok(Some(sum))
}

/// What so many trials are; how long they take at most, where the plan says it. Nothing where none is left.
fn extent(plan: &Plan, trials: usize) -> Option<String> {
    let counted = output::count(trials as u64, "trial");
    let extent = match plan {
        Plan::Fitts(_) => counted,
        Plan::Perception(plan) => {
            let trial_s = operator::trial_s(plan);
            #[expect(clippy::cast_precision_loss, reason = "a count of trials")]
            let all_min = (trials as f64 * trial_s / 60.0).ceil();
            format!("at most {counted} of {trial_s:.1} s, {all_min} min; simulated faster")
        }
    };
    (trials > 0).then_some(extent)
}

/// What stands behind the position of a run: trials of all of them, or subjects where that is not known.
fn under_way(trials: Option<(usize, usize)>, progress: &Progress, subjects: usize, took_s: f64) -> String {
    let done = progress.trials();
    let Some((before, of)) = trials else {
        return format!("subjects, {done} trials");
    };
    let left = of.saturating_sub(before + done);
    let left = time_left(done, took_s, left).map_or_else(String::new, |left| format!(", {left}"));
    format!("trials, {} of {subjects} subjects{left}", progress.subjects())
}

fn not_run(error: RunError) -> Failure {
    match error {
        RunError::Store(StoreError::File { path, source }) => Failure::File(format!("{}: {source}", path.display())),
        error => Failure::Usage(error.to_string()),
    }
}

fn report(progress: &Progress, folder: &Path, is_finished: bool, took_s: f64, as_json: bool) -> Result<(), Failure> {
    let (trials, simulated_s) = (progress.trials(), progress.simulated_s());
    let factor = simulated_s / took_s;
    let place = folder.display();
    if as_json {
        return output::json(&json!({
            "folder": folder,
            "operator": "simulated",
            "finished": is_finished,
            "trials": trials,
            "simulated_s": simulated_s,
            "took_s": took_s,
            "faster_than_real_time": factor,
        }));
    }
    if is_finished && trials == 0 {
        return output::text(&format!(
            "{place}, operator: simulated: all trials were done before. The study is finished."
        ));
    }
    output::text(&format!(
        "{place}, operator: simulated: {trials} trials, {simulated_s:.0} s of rig time, in {took_s:.1} s, {factor:.0} times as \
         fast as real time"
    ))?;
    if is_finished {
        return output::text("The study is finished.");
    }
    output::text(&format!(
        "The study is interrupted; continue with `haptic-ctl study resume {}`.",
        quoted(folder)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_says_first_how_long_it_takes_at_most() {
        let text = |name: &str, trials| extent(&plan::read(name).expect("a plan").0, trials);
        assert_eq!(
            text("perception", 808).as_deref(),
            Some("at most 808 trials of 7.5 s, 102 min; simulated faster")
        );
        assert_eq!(text("fitts", 880).as_deref(), Some("880 trials"));
        assert_eq!(text("perception", 0), None);
    }
}
