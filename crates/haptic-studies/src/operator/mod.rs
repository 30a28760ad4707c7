//! A simulated subject: a script that moves the handle by minimum jerk with noise, which shows that a study runs and
//! how its analysis reads, and nothing about people.
//!
//! The rig is the daemon's [servo](haptic_core::servo::Servo) on the fake rig's
//! [carriage](device_io::fake::Plant), a tick after the other without waiting. A segment, or a trial of a perception
//! test, depends on the plan, the seed, the subject and its own number alone, so that it can be run anywhere, and
//! again.

mod feel;
mod hand;
mod reach;
mod rig;

pub use rig::{PERIOD_S, setup};

use super::plan::{MountedBlock, PerceptionPlan};
use super::random::{Purpose, Random};
use super::session::{FinishedTrial, News, Phase, Session, Task};
use super::subject::Subject;
use feel::{Sensation, Strokes};
use haptic_core::{Scene, SceneError};
use reach::Reach;
use rig::Rig;

/// Longest time of a trial, s: an operator with these constants does not hit the target.
const MAX_TRIAL_S: f64 = 60.0;

/// Time in which a subject answers, s: ours, and no model of decisions.
const ANSWER_S: f64 = 0.4;

/// Why a simulated operator cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum OperatorError {
    /// A surface cannot be rendered.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No valid click came.
    #[error(
        "subject {subject}, block {block}, {resistance}, condition {condition}: no valid click within {MAX_TRIAL_S} s; the \
         simulated subject cannot hit this target"
    )]
    NoHit {
        /// The subject's code.
        subject: String,
        /// The segment.
        block: u32,
        /// The resistance.
        resistance: String,
        /// The condition.
        condition: String,
    },
}

/// Time of the rig that a trial of a perception test takes, s: it engages, and renders two surfaces, each after a gap.
#[must_use]
pub fn trial_s(plan: &PerceptionPlan) -> f64 {
    rig::ENGAGED_S + 2.0 * (plan.gap_s + plan.interval_s)
}

/// Does what comes next: the segment of the targeting task that the session is at, from its beginning, or a trial of
/// the perception tests. `done` takes each trial, and ends it by `false`.
///
/// # Errors
/// A surface cannot be rendered, or a target is not hit.
pub fn run_next(
    session: &mut Session,
    seed: u64,
    subject: &Subject,
    mut done: impl FnMut(FinishedTrial) -> bool,
) -> Result<(), OperatorError> {
    session.restart_segment();
    // The hand of this model is put back between two segments, and the rig set up again.
    session.new_link();
    while session.waits_for_consent() {
        session.proceed();
    }
    let Some(scene) = session.take_scene() else {
        return Ok(());
    };
    match session.task() {
        Task::Fitts(_) => run_segment(session, &scene, seed, subject, &mut done),
        Task::Perception(_) => run_trial(session, &scene, seed, subject, &mut done),
    }
}

fn run_segment(
    session: &mut Session,
    scene: &Scene,
    seed: u64,
    subject: &Subject,
    done: &mut impl FnMut(FinishedTrial) -> bool,
) -> Result<(), OperatorError> {
    let Task::Fitts(task) = session.task() else {
        return Ok(());
    };
    let ((number, _), mapping) = (task.place(), task.mapping());
    let Some(segment) = task.segment().cloned() else {
        return Ok(());
    };
    let start_m = mapping.rig_m(-0.5 * segment.condition.amplitude_m);
    let mut rig = Rig::new(scene, segment.resistance.mounted.unwrap_or_default(), start_m)?;
    session.rendered(rig.revision(), 0);
    let random = Random::new(seed, subject.number, Purpose::Noise, number as u64);
    let mut operator = Reach::new(mapping, start_m, random);
    let mut ticks = 0;
    while let Task::Fitts(task) = session.task()
        && task.place().0 == number
    {
        let (force_n, clicked) = operator.tick(&rig, task.targets());
        let row = rig.tick(force_n);
        session.row(&row);
        if clicked {
            session.click(row.tick);
        }
        ticks += 1;
        if let Some(News::Finished(finished)) = session.take_news() {
            ticks = 0;
            if !done(*finished) {
                return Ok(());
            }
        }
        if f64::from(ticks) * PERIOD_S > MAX_TRIAL_S {
            return Err(OperatorError::NoHit {
                subject: subject.code.clone(),
                block: segment.block,
                resistance: segment.resistance.name,
                condition: segment.condition.name,
            });
        }
    }
    Ok(())
}

fn run_trial(
    session: &mut Session,
    base: &Scene,
    seed: u64,
    subject: &Subject,
    done: &mut impl FnMut(FinishedTrial) -> bool,
) -> Result<(), OperatorError> {
    let Task::Perception(task) = session.task() else {
        return Ok(());
    };
    let (number, _) = task.progress();
    let mut rig = Rig::new(base, MountedBlock::default(), 0.0)?;
    session.rendered(rig.revision(), 0);
    let random = Random::new(seed, subject.number, Purpose::Noise, number as u64);
    let mut strokes = Strokes::new(random);
    let mut felt = [Sensation::default(); 2];
    let asked_tick = loop {
        let phase = session.view().phase;
        let row = rig.tick(strokes.force_n(&rig, matches!(phase, Phase::Feel(_))));
        session.row(&row);
        match phase {
            Phase::Feel(1) => felt[0].feel(&row),
            Phase::Feel(_) => felt[1].feel(&row),
            Phase::Question => break row.tick,
            _ => {}
        }
        if let Some(next) = session.take_scene() {
            session.mark(rig.change_scene(&next, CHANGE_S)?);
            session.rendered(rig.revision(), row.tick + ticks(CHANGE_S) + 1);
        }
    };
    let answer = strokes.answer(felt);
    session.answer(answer, asked_tick + ticks(ANSWER_S));
    if let Some(News::Finished(finished)) = session.take_news() {
        done(*finished);
    }
    Ok(())
}

#[expect(clippy::cast_sign_loss, reason = "less than a second")]
fn ticks(seconds: f64) -> u64 {
    (seconds / PERIOD_S).round() as u64
}

/// Time in which one surface goes over into the other, s: within the shortest gap.
const CHANGE_S: f64 = 0.05;

#[cfg(test)]
mod tests;
