//! Runs a study on the disk by simulated operators, several subjects at a time.
//!
//! No subject depends on another, and no trial on where the study was broken off before it: the data are the same
//! however many threads run it, and however often it was killed.

use super::operator::{self, OperatorError};
use super::plan::Task as Kind;
use super::session::{FinishedTrial, News, Session, Task, TrialRow};
use super::store::{Keeper, RigDescription, StoreError, Study, trials_of};
use super::subject::Subject;
use super::trial::{FittsTrial, Operator};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Why a study cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// It cannot be stored.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The operator cannot continue.
    #[error(transparent)]
    Operator(#[from] OperatorError),
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
    #[error("people do this study: continue with the panel's pages Task and Perception, `haptic-gui --page task`")]
    NeedsPeople,
}

/// How far a run is.
#[derive(Debug, Default)]
pub struct Progress {
    trials: AtomicUsize,
    subjects: AtomicUsize,
    /// Ticks of the rig.
    ticks: AtomicUsize,
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
    pub fn simulated_s(&self) -> f64 {
        self.ticks.load(Ordering::Relaxed) as f64 * operator::PERIOD_S
    }

    fn done(&self, ticks: usize) {
        self.trials.fetch_add(1, Ordering::Relaxed);
        self.ticks.fetch_add(ticks, Ordering::Relaxed);
    }
}

/// Runs what is left of a study on `threads` threads, until it is done or stopped.
///
/// # Errors
/// It cannot be stored, or the operator cannot continue. What is done by then is on the disk.
pub fn run(study: &Study, threads: usize, progress: &Progress) -> Result<(), RunError> {
    if study.about().operator != Operator::Simulated {
        return Err(RunError::NeedsPeople);
    }
    let subjects: Vec<Subject> = study.subjects().collect();
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(None));
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, subjects.len().max(1)) {
            scope.spawn(|| {
                while let Some(subject) = subjects.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if progress.is_stopped() {
                        return;
                    }
                    if let Err(error) = run_subject(study, subject, progress) {
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
        study.collect()?;
    }
    Ok(())
}

fn run_subject(study: &Study, subject: &Subject, progress: &Progress) -> Result<(), RunError> {
    let seed = study.about().seed;
    let (mut keeper, mut session) = Keeper::open(study, subject, rig(study))?;
    while !session.is_done() {
        if progress.is_stopped() {
            return Ok(());
        }
        // The hand of a trial is where the trial before left it: a segment that was broken off is done again from its
        // beginning, and what is on the disk by then must come out again.
        let mut known = rows_of_segment(study, subject, &session)?;
        let mut result = Ok(());
        operator::run_next(&mut session, seed, subject, |finished| {
            result = match known.pop_front() {
                Some(row) => is_again(&row, &finished.row),
                None => keep(&mut keeper, finished, progress),
            };
            result.is_ok() && !(progress.is_stopped() && known.is_empty())
        })?;
        result?;
    }
    progress.subjects.fetch_add(1, Ordering::Relaxed);
    Ok(())
}

/// The fake rig's carriage, in simulated time.
fn rig(study: &Study) -> RigDescription {
    RigDescription {
        server: study.about().program.clone(),
        device: "the fake rig's carriage, held by a simulated operator".to_owned(),
        loop_rate_hz: 1.0 / operator::PERIOD_S,
        servo: Some(operator::setup()),
        configuration: None,
        click_buttons: 0,
    }
}

/// The rows of the segment under way.
fn rows_of_segment(study: &Study, subject: &Subject, session: &Session) -> Result<VecDeque<FittsTrial>, StoreError> {
    let Task::Fitts(task) = session.task() else {
        return Ok(VecDeque::new());
    };
    let (_, done) = task.place();
    if done == 0 {
        return Ok(VecDeque::new());
    }
    let rows = trials_of(study.folder(), subject, Kind::Fitts, session.task().is_practice())?;
    Ok(rows[rows.len() - done as usize..].iter().cloned().collect())
}

fn is_again(known: &FittsTrial, again: &TrialRow) -> Result<(), RunError> {
    let is_same = matches!(again, TrialRow::Fitts(again) if *known == FittsTrial {
        recording: known.recording.clone(),
        ..(**again).clone()
    });
    if is_same {
        return Ok(());
    }
    Err(RunError::Differs {
        subject: known.subject.clone(),
        block: known.block,
        trial: known.trial,
    })
}

/// Puts a trial on the disk.
fn keep(keeper: &mut Keeper, finished: FinishedTrial, progress: &Progress) -> Result<(), RunError> {
    let ticks = finished.ticks.as_ref().map_or(0, |ticks| ticks.rows.len());
    keeper.keep(News::Finished(Box::new(finished)))?;
    progress.done(ticks);
    Ok(())
}
