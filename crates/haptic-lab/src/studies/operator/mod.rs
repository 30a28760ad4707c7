//! A simulated operator: a model of a person at the rig, which shows that a study runs and how its analysis reads, and
//! nothing about people.
//!
//! The rig is the daemon's [servo](haptic_core::servo::Servo) on the fake rig's
//! [carriage](device_io::fake::Plant), a tick after the other without waiting. The operator is an arm that follows
//! movements of minimum jerk, with noise, a visual delay and corrections; every constant is in [`Constants`]. A subject
//! is a draw of these around the usual ones. A segment, or a trial of a perception test, depends on the plan, the seed,
//! the subject and its own number alone, so that it can be run anywhere, and again.

mod arm;
mod constants;
mod feel;
mod reach;
mod rig;

pub use constants::{Constant, ConstantError, Constants};
pub use rig::{PERIOD_S, setup};

use super::fitts::{self, Event, FittsSession, Segment};
use super::perception::{PerceptionSession, Prompt};
use super::plan::{FittsPlan, Resistance};
use super::random::{Purpose, Random};
use super::subject::Subject;
use super::trial::{FittsTrial, PerceptionTrial};
use crate::recording::Entry;
use feel::{Felt, Strokes};
use haptic_core::friction::Friction;
use haptic_core::{Scene, SceneError};
use reach::Reach;
use rig::{Load, Rig};

/// Longest time of a trial, s: an operator with these constants does not hit the target.
const LONGEST_TRIAL_S: f64 = 60.0;

/// Time in which a subject answers, s: ours, and no model of decisions.
const ANSWER_S: f64 = 0.4;

/// Why a simulated operator cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum OperatorError {
    /// A surface cannot be rendered.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No valid click came.
    #[error(
        "subject {subject}, block {block}, {resistance}, condition {condition}: no valid click within {LONGEST_TRIAL_S} s; the \
         operator's constants do not allow for this target"
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

/// A trial that a simulated operator did.
#[derive(Debug)]
pub struct Done<T> {
    /// Its row.
    pub trial: T,
    /// The scene at its beginning.
    pub scene: Scene,
    /// Its ticks, and the changes of scene between them.
    pub entries: Vec<Entry>,
    /// Time since the trial before, or since the rig was set up, s.
    pub duration_s: f64,
}

/// The constants of a subject: those of the study, each of arm, noise and delay with a factor of its own.
#[must_use]
pub fn person(constants: &Constants, seed: u64, subject: &Subject) -> Constants {
    let mut random = Random::new(seed, subject.number, Purpose::Person, 0);
    let mut person = constants.clone();
    for value in [
        &mut person.arm_mass_kg,
        &mut person.arm_stiffness_n_per_m,
        &mut person.arm_damping_ns_per_m,
        &mut person.endpoint_noise_s,
        &mut person.force_noise,
        &mut person.visual_delay_s,
        &mut person.sliding_noise,
        &mut person.breakaway_noise,
    ] {
        // Three deviations at most, so that with the widest spread no factor comes near 0.
        *value *= 1.0 + constants.person_spread * random.normal().clamp(-3.0, 3.0);
    }
    person
}

/// What a resistance is to a hand that knows it. Of laws other than Karnopp's and drag it knows nothing.
fn load(resistance: &Resistance) -> Load {
    match (&resistance.scene, resistance.mounted) {
        (_, Some(mounted)) => Load {
            mass_kg: mounted.mass_kg,
            static_n: mounted.static_force_n,
            dynamic_n: mounted.dynamic_force_n,
            viscous_ns_per_m: 0.0,
        },
        (Some(scene), None) => load_of(scene),
        (None, None) => Load::default(),
    }
}

fn load_of(scene: &Scene) -> Load {
    let mass_kg = scene.block.map_or(0.0, |block| block.mass);
    let load = match &scene.friction {
        Friction::Karnopp(law) => Load {
            static_n: law.static_force.greatest(),
            dynamic_n: law.dynamic_force.greatest(),
            viscous_ns_per_m: law.viscous.greatest(),
            ..Load::default()
        },
        Friction::Viscous(law) => Load {
            viscous_ns_per_m: law.viscous.greatest(),
            ..Load::default()
        },
        _ => Load::default(),
    };
    Load { mass_kg, ..load }
}

/// Does the segment that the session is at, from its beginning; `done` takes each trial, and ends the segment by `false`.
///
/// # Errors
/// A surface cannot be rendered, or a target is not hit.
pub fn run_segment(
    session: &mut FittsSession,
    plan: &FittsPlan,
    person: &Constants,
    seed: u64,
    subject: &Subject,
    mut done: impl FnMut(Done<FittsTrial>) -> bool,
) -> Result<(), OperatorError> {
    let (number, _) = session.place();
    let Some(segment) = session.segment().cloned() else {
        return Ok(());
    };
    let start_m = plan.rig.rig_m(-0.5 * segment.condition.amplitude_m);
    let load = load(&segment.resistance);
    let mounted = if segment.resistance.mounted.is_some() {
        load
    } else {
        Load::default()
    };
    let scene = segment.resistance.rendered();
    let mut rig = Rig::new(&scene, mounted, person.arm_mass_kg, start_m)?;
    let random = Random::new(seed, subject.number, Purpose::Noise, number as u64);
    let mut operator = Reach::new(person, plan.rig, load, start_m, random);
    let mut entries = Vec::new();
    while session.place().0 == number {
        if rig.is_engaged() {
            session.begin();
        }
        let (force_n, clicked) = operator.tick(&rig, &session.view());
        let row = rig.tick(force_n);
        entries.push(Entry::Row(row));
        let sample = fitts::Sample {
            tick: row.tick,
            position_m: row.device_position_m,
            revision: row.revision,
            clicked,
        };
        match session.step(&sample) {
            Some(Event::Hit(trial)) => {
                let entries = std::mem::take(&mut entries);
                let duration_s = seconds(entries.len());
                let scene = scene.clone();
                if !done(Done {
                    trial: *trial,
                    scene,
                    entries,
                    duration_s,
                }) {
                    return Ok(());
                }
            }
            _ if seconds(entries.len()) > LONGEST_TRIAL_S => return Err(no_hit(subject, &segment)),
            _ => {}
        }
    }
    Ok(())
}

#[expect(clippy::cast_precision_loss, reason = "a minute of ticks")]
fn seconds(ticks: usize) -> f64 {
    ticks as f64 * PERIOD_S
}

fn no_hit(subject: &Subject, segment: &Segment) -> OperatorError {
    OperatorError::NoHit {
        subject: subject.code.clone(),
        block: segment.block,
        resistance: segment.resistance.name.clone(),
        condition: segment.condition.name.clone(),
    }
}

/// Does the trial that the session is at; none where all is done.
///
/// # Errors
/// A surface cannot be rendered.
pub fn run_trial(
    session: &mut PerceptionSession,
    base: &Scene,
    person: &Constants,
    seed: u64,
    subject: &Subject,
) -> Result<Option<Done<PerceptionTrial>>, OperatorError> {
    let (number, _) = session.progress();
    if session.upcoming().is_none() {
        return Ok(None);
    }
    let mut surface = base.clone();
    let mut rig = Rig::new(&surface, Load::default(), person.arm_mass_kg, 0.0)?;
    let random = Random::new(seed, subject.number, Purpose::Noise, number as u64);
    let mut strokes = Strokes::new(person, load_of(base), random);
    let mut felt = [Felt::default(); 2];
    let mut entries = Vec::new();
    let asked_tick = loop {
        let prompt = session.prompt();
        let row = rig.tick(strokes.force_n(&rig, matches!(prompt, Prompt::Feel(_))));
        entries.push(Entry::Row(row));
        match prompt {
            Prompt::Feel(1) => felt[0].feel(&row),
            Prompt::Feel(_) => felt[1].feel(&row),
            Prompt::Question => break row.tick,
            _ => {}
        }
        if rig.is_engaged() {
            session.begin(row.tick);
        }
        session.step(row.tick);
        if let Some(next) = session.surface()
            && next != surface
        {
            entries.push(Entry::Mark(rig.change_scene(&next, CHANGE_S)?));
            surface = next;
        }
    };
    let answer = strokes.answer(person, felt);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a constant")]
    let answered_tick = asked_tick + (ANSWER_S / PERIOD_S) as u64;
    let trial = session.answer(answer, answered_tick);
    Ok(trial.map(|trial| Done {
        trial,
        scene: base.clone(),
        duration_s: seconds(entries.len()) + ANSWER_S,
        entries,
    }))
}

/// Time in which one surface goes over into the other, s: within the shortest gap.
const CHANGE_S: f64 = 0.05;

#[cfg(test)]
mod tests;
