//! Runs a study on the disk by simulated operators, several subjects at a time.
//!
//! No subject depends on another, and no trial on where the study was broken off before it: the data are the same
//! however many threads run it, and however often it was killed.

use super::fitts::FittsSession;
use super::operator::{self, Constants, Done, OperatorError};
use super::perception::PerceptionSession;
use super::plan::{FittsPlan, PerceptionPlan, Plan};
use super::resume::NotThisStudy;
use super::store::{StoreError, Study, SubjectFiles};
use super::subject::Subject;
use super::trial::{FittsTrial, Operator, PerceptionTrial, Trial};
use crate::recording::Metadata;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Why a study cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// It cannot be stored.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The operator cannot go on.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// The rows are not those of the plan.
    #[error(transparent)]
    NotThisStudy(#[from] NotThisStudy),
    /// The operator does not do again what it did.
    #[error(
        "subject {subject}, block {block}, trial {trial}: this program's operator does not do the same again: another version \
         made this study; finish it with that one"
    )]
    Differs {
        /// The subject's code.
        subject: String,
        /// The segment.
        block: u32,
        /// The trial.
        trial: u32,
    },
    /// People are not simulated.
    #[error("people do this study: a program with a screen goes on with it")]
    NeedsPeople,
}

/// How far a run is.
#[derive(Debug, Default)]
pub struct Progress {
    trials: AtomicUsize,
    subjects: AtomicUsize,
    /// Milliseconds of the rig.
    simulated_ms: AtomicUsize,
    stop: AtomicBool,
}

impl Progress {
    /// Ends the run after the trials under way.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Trials done by this run.
    #[must_use]
    pub fn trials(&self) -> usize {
        self.trials.load(Ordering::Relaxed)
    }

    /// Subjects whose trials are all done.
    #[must_use]
    pub fn subjects(&self) -> usize {
        self.subjects.load(Ordering::Relaxed)
    }

    /// Time of the rig that was simulated, s.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "milliseconds of a study")]
    pub fn simulated_s(&self) -> f64 {
        self.simulated_ms.load(Ordering::Relaxed) as f64 * 1e-3
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a minute at most"
    )]
    fn done(&self, duration_s: f64) {
        self.trials.fetch_add(1, Ordering::Relaxed);
        self.simulated_ms
            .fetch_add((duration_s * 1e3) as usize, Ordering::Relaxed);
    }
}

/// Runs what is left of a study on so many threads, until it is done or stopped.
///
/// # Errors
/// It cannot be stored, or the operator cannot go on. What is done by then is on the disk.
pub fn run(study: &Study, threads: usize, progress: &Progress) -> Result<(), RunError> {
    let Some(constants) = study
        .about()
        .constants
        .as_ref()
        .filter(|_| study.about().operator == Operator::Simulated)
    else {
        return Err(RunError::NeedsPeople);
    };
    let subjects: Vec<Subject> = study.subjects().collect();
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(None));
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, subjects.len().max(1)) {
            scope.spawn(|| {
                while let Some(subject) = subjects.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if progress.is_stopped() {
                        return;
                    }
                    if let Err(error) = run_subject(study, constants, subject, progress) {
                        progress.stop();
                        let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
                        failed.get_or_insert(error);
                        return;
                    }
                }
            });
        }
    });
    if let Some(error) = failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    if progress.subjects() == subjects.len() {
        match study.plan() {
            Plan::Fitts(_) => study.finish::<FittsTrial>()?,
            Plan::Perception(_) => study.finish::<PerceptionTrial>()?,
        };
    }
    Ok(())
}

fn run_subject(study: &Study, constants: &Constants, subject: &Subject, progress: &Progress) -> Result<(), RunError> {
    let person = operator::person(constants, study.about().seed, subject);
    let is_done = match study.plan() {
        Plan::Fitts(plan) => run_fitts(study, plan, &person, subject, progress)?,
        Plan::Perception(plan) => run_perception(study, plan, &person, subject, progress)?,
    };
    progress.subjects.fetch_add(usize::from(is_done), Ordering::Relaxed);
    Ok(())
}

/// Runs a subject's targeting task; whether it is done.
fn run_fitts(
    study: &Study,
    plan: &FittsPlan,
    person: &Constants,
    subject: &Subject,
    progress: &Progress,
) -> Result<bool, RunError> {
    let seed = study.about().seed;
    let mut files = study.subject::<FittsTrial>(subject)?;
    let mut session = FittsSession::new(plan, seed, subject, Operator::Simulated, operator::PERIOD_S);
    session.resume(files.practice(), files.trials())?;
    while let Some(segment) = session.segment().cloned() {
        // The hand of a trial is where the trial before left it: a segment that was broken off is done again from its
        // beginning, and what is on the disk by then must come out again.
        let (_, known) = session.place();
        let rows = if segment.is_practice {
            files.practice()
        } else {
            files.trials()
        };
        let mut known: VecDeque<FittsTrial> = rows[rows.len() - known as usize..].iter().cloned().collect();
        session.restart_segment();
        let mut result = Ok(());
        operator::run_segment(&mut session, plan, person, seed, subject, |done| {
            result = match known.pop_front() {
                Some(row) => is_again(&row, &done.trial),
                None => save(study, &mut files, segment.is_practice, done, progress),
            };
            result.is_ok() && !(progress.is_stopped() && known.is_empty())
        })?;
        result?;
        if progress.is_stopped() {
            return Ok(session.segment().is_none());
        }
    }
    Ok(true)
}

fn is_again(row: &FittsTrial, again: &FittsTrial) -> Result<(), RunError> {
    let recording = row.recording.clone();
    if *row
        == (FittsTrial {
            recording,
            ..again.clone()
        })
    {
        return Ok(());
    }
    Err(RunError::Differs {
        subject: row.subject.clone(),
        block: row.block,
        trial: row.trial,
    })
}

/// Runs a subject's perception tests; whether they are done.
fn run_perception(
    study: &Study,
    plan: &PerceptionPlan,
    person: &Constants,
    subject: &Subject,
    progress: &Progress,
) -> Result<bool, RunError> {
    let seed = study.about().seed;
    let mut files = study.subject::<PerceptionTrial>(subject)?;
    let mut session = PerceptionSession::new(plan, seed, subject, Operator::Simulated, operator::PERIOD_S);
    session.resume(files.practice(), files.trials())?;
    while let Some(upcoming) = session.upcoming() {
        if progress.is_stopped() {
            return Ok(false);
        }
        let Some(done) = operator::run_trial(&mut session, &plan.base, person, seed, subject)? else {
            break;
        };
        save(study, &mut files, upcoming.is_practice, done, progress)?;
    }
    Ok(true)
}

/// A row that names its recording.
trait Recorded: Trial {
    fn recorded(&mut self, path: String);
}

impl Recorded for FittsTrial {
    fn recorded(&mut self, path: String) {
        self.recording = Some(path);
    }
}

impl Recorded for PerceptionTrial {
    fn recorded(&mut self, path: String) {
        self.recording = Some(path);
    }
}

/// Puts a trial on the disk.
fn save<T: Recorded>(
    study: &Study,
    files: &mut SubjectFiles<T>,
    is_practice: bool,
    done: Done<T>,
    progress: &Progress,
) -> Result<(), RunError> {
    let Done {
        mut trial,
        scene,
        entries,
        duration_s,
    } = done;
    if study.about().recordings {
        let metadata = Metadata {
            server: study.about().program.clone(),
            device: "the fake rig's carriage, held by a simulated operator".to_owned(),
            loop_rate_hz: 1.0 / operator::PERIOD_S,
            rate_hz: 1.0 / operator::PERIOD_S,
            // Simulated time has no date.
            started_unix_s: 0.0,
            revision: 1,
            scene,
            servo: Some(operator::setup()),
            recorded_by: Some(study.about().program.clone()),
            notes: Some("operator: simulated".to_owned()),
            configuration: None,
        };
        trial.recorded(files.record(is_practice, &metadata, &entries)?);
    }
    files.append(trial, is_practice)?;
    progress.done(duration_s);
    Ok(())
}
