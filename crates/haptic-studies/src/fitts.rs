//! The targeting task as a state machine.
//!
//! ```text
//! Ready --begin--> Start --valid click--> Trial --valid click--> Trial ... --last one--> Ready (a break, the next segment) ... Finished
//!   ^                                       |
//!   +---------------- pause ----------------+   the trial under way is done again
//! ```
//!
//! A segment begins with a click on the target opposite to the first trial's; that click is not a trial. Each valid
//! click ends a trial and activates the other target in the same tick, so a movement time is the time between two
//! valid clicks. A click is valid where the whole cursor is inside the target.

use super::order::places;
use super::plan::{Condition, FittsPlan, Resistance, RigMapping};
use super::random::{Purpose, Random};
use super::subject::{StudyMismatch, Subject, compare};
use super::trial::{FittsTrial, Operator};

/// Trials of one condition under one resistance, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Its number, from 1; of practice from 1 as well.
    pub block: u32,
    /// Whether it is for practice: its rows are kept apart.
    pub is_practice: bool,
    /// The resistance.
    pub resistance: Resistance,
    /// The condition.
    pub condition: Condition,
    /// Whether a break is offered before it.
    pub after_rest: bool,
}

/// The segments of a subject: practice, the baseline in each condition, then every resistance in each condition.
/// Resistances come in the plan's order or the subject's own, conditions within each in random order.
#[must_use]
pub fn segments(plan: &FittsPlan, seed: u64, subject: &Subject) -> Vec<Segment> {
    let random = |item| Random::new(seed, subject.number, Purpose::Order, item);
    let order = places(plan.order, &plan.resistance_names(), seed, subject);
    let mut rounds: Vec<&Resistance> = order.into_iter().map(|place| &plan.resistances[place]).collect();
    let baseline = plan.resistances.iter().filter(|one| one.name == plan.baseline);
    rounds.splice(0..0, baseline);
    let segment = |block, is_practice, resistance: &Resistance, condition: &Condition, after_rest| Segment {
        block,
        is_practice,
        resistance: resistance.clone(),
        condition: condition.clone(),
        after_rest,
    };
    let shuffled = |item| {
        let mut conditions: Vec<&Condition> = plan.conditions.iter().collect();
        random(item).shuffle(&mut conditions);
        conditions
    };
    // Practice is drawn last, so that its length changes nothing of the rest.
    let practice = shuffled(u64::MAX);
    let practice = (1..=plan.practice_segments).zip(practice.into_iter().cycle());
    let mut segments: Vec<Segment> = practice
        .map(|(block, condition)| segment(block, true, rounds[0], condition, false))
        .collect();
    let mut block = 0;
    for (round, resistance) in (1..).zip(&rounds) {
        for (index, condition) in shuffled(round).into_iter().enumerate() {
            let after_rest = block > 0 && (index == 0 || block % plan.rest_every_segments == 0);
            block += 1;
            segments.push(segment(block, false, resistance, condition, after_rest));
        }
    }
    segments
}

/// What came of a click.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The segment began: its first trial's target is active.
    Started,
    /// The cursor was not wholly inside.
    Missed,
    /// A trial is done. Keep its row before the next batch of ticks.
    Hit(Box<FittsTrial>),
}

/// Where a subject is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Before a segment, or paused.
    Ready,
    /// The target that the segment starts from is active.
    Start,
    /// A trial's target is active.
    Trial,
    /// All is done.
    Finished,
}

/// Two targets, left and right of the middle of the task; lengths in m of the task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Targets {
    /// Centre of the active target.
    pub active_m: f64,
    /// Centre of the other target.
    pub other_m: f64,
    /// Width of the targets.
    pub width_m: f64,
    /// Diameter of the cursor.
    pub cursor_diameter_m: f64,
    /// Whether the active target is the one that a segment starts from: its click is not a trial.
    pub is_start: bool,
}

/// A trial under way.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    start_tick: u64,
    errors: u32,
    error_size_m: f64,
}

/// A subject's targeting task.
#[derive(Debug)]
pub struct FittsSession {
    plan: FittsPlan,
    subject: Subject,
    operator: Operator,
    period_s: f64,
    segments: Vec<Segment>,
    /// The segment, and the trials of it that are done.
    at: (usize, u32),
    phase: Phase,
    trial: Progress,
}

impl FittsSession {
    /// One that nobody has begun. A tick takes `period_s`, s.
    #[must_use]
    pub fn new(plan: &FittsPlan, seed: u64, subject: &Subject, operator: Operator, period_s: f64) -> Self {
        Self {
            plan: plan.clone(),
            subject: subject.clone(),
            operator,
            period_s,
            segments: segments(plan, seed, subject),
            at: (0, 0),
            phase: Phase::Ready,
            trial: Progress::default(),
        }
    }

    /// Goes on after these rows: first those of practice.
    ///
    /// # Errors
    /// They are not rows of this subject in this study.
    pub fn resume(&mut self, practice: &[FittsTrial], trials: &[FittsTrial]) -> Result<(), StudyMismatch> {
        for (rows, is_practice) in [(practice, true), (trials, false)] {
            for (row, trial) in (1..).zip(rows) {
                let segment = self.segment().filter(|segment| segment.is_practice == is_practice);
                let expected = segment.map(|segment| {
                    let condition = &segment.condition;
                    [
                        segment.block.to_string(),
                        segment.resistance.name.clone(),
                        condition.name.clone(),
                    ]
                });
                let [block, resistance, condition] = expected.unwrap_or_else(|| ["no row"; 3].map(str::to_owned));
                let cells = [
                    ("subject", trial.subject.clone(), self.subject.code.clone()),
                    ("block", trial.block.to_string(), block),
                    ("resistance", trial.resistance.clone(), resistance),
                    ("condition", trial.condition.clone(), condition),
                    ("trial", trial.trial.to_string(), (self.at.1 + 1).to_string()),
                ];
                compare(&self.subject.code, row, &cells)?;
                self.advance();
            }
        }
        Ok(())
    }

    /// The segment that is done now, or next.
    #[must_use]
    pub fn segment(&self) -> Option<&Segment> {
        self.segments.get(self.at.0)
    }

    /// The number of that segment among all, from 0, and the trials of it that are done.
    #[must_use]
    pub fn place(&self) -> (usize, u32) {
        self.at
    }

    /// Trials done, and trials in all, practice included.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        let per_segment = self.plan.trials_per_segment as usize;
        (
            self.at.0 * per_segment + self.at.1 as usize,
            self.segments.len() * per_segment,
        )
    }

    /// Rows of practice that are done, and rows of trials.
    #[must_use]
    pub fn rows(&self) -> (u32, u32) {
        let per_segment = self.plan.trials_per_segment;
        let segments = u32::try_from(self.at.0).unwrap_or(u32::MAX);
        let done = segments.saturating_mul(per_segment).saturating_add(self.at.1);
        let practice = done.min(self.plan.practice_segments * per_segment);
        (practice, done - practice)
    }

    /// How the handle moves the cursor.
    #[must_use]
    pub fn mapping(&self) -> RigMapping {
        self.plan.rig
    }

    /// Shows the target that the segment starts from. Without effect where it was shown already.
    pub fn begin(&mut self) {
        if self.phase == Phase::Ready && self.segment().is_some() {
            self.phase = Phase::Start;
        }
    }

    /// Takes the targets away. The trial under way is done again after [`begin`](Self::begin).
    pub fn pause(&mut self) {
        if self.phase != Phase::Finished {
            self.phase = Phase::Ready;
            self.trial = Progress::default();
        }
    }

    /// Goes back to the beginning of the segment.
    pub fn restart_segment(&mut self) {
        self.pause();
        self.at.1 = 0;
    }

    /// Where the subject is.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Length of the break that is offered, s; 0 where there is none.
    #[must_use]
    pub fn rest_s(&self) -> f64 {
        let rests = self.phase == Phase::Ready && self.at.1 == 0;
        let segment = self.segment().filter(|segment| rests && segment.after_rest);
        segment.map_or(0.0, |_| self.plan.rest_s)
    }

    /// Direction of the trial that is next: the first of a segment goes the positive way, and they alternate.
    fn direction(&self) -> i8 {
        if self.at.1.is_multiple_of(2) { 1 } else { -1 }
    }

    /// The targets; none before a segment, or while it is paused.
    #[must_use]
    pub fn targets(&self) -> Option<Targets> {
        let is_start = self.phase == Phase::Start;
        let side = if is_start { -self.direction() } else { self.direction() };
        let condition = &self.segment()?.condition;
        let active_m = f64::from(side) * 0.5 * condition.amplitude_m;
        matches!(self.phase, Phase::Start | Phase::Trial).then_some(Targets {
            active_m,
            other_m: -active_m,
            width_m: condition.width_m,
            cursor_diameter_m: self.plan.cursor.diameter_m,
            is_start,
        })
    }

    /// Takes a click at a tick, with the handle at a position, m, under a revision of the scene.
    pub fn click(&mut self, tick: u64, position_m: f64, revision: u64) -> Option<Event> {
        let (targets, segment) = (self.targets()?, self.segment()?);
        // A click in the tick of the last one, or before it, is the same click.
        if !targets.is_start && tick <= self.trial.start_tick {
            return None;
        }
        let error_m = self.plan.rig.task_m(position_m) - targets.active_m;
        let size_m = error_m.abs() + 0.5 * (targets.cursor_diameter_m - targets.width_m);
        // A position that is not a number is inside nothing.
        if !size_m.is_finite() {
            return None;
        }
        if size_m > 0.0 {
            if !targets.is_start {
                self.trial.errors += 1;
                self.trial.error_size_m += size_m;
            }
            return Some(Event::Missed);
        }
        if targets.is_start {
            self.phase = Phase::Trial;
            self.begin_trial(tick);
            return Some(Event::Started);
        }
        let row = self.row(segment, error_m, tick, revision);
        self.advance();
        self.begin_trial(tick);
        Some(Event::Hit(Box::new(row)))
    }

    fn row(&self, segment: &Segment, error_m: f64, tick: u64, revision: u64) -> FittsTrial {
        let direction = self.direction();
        FittsTrial {
            operator: Some(self.operator),
            subject: self.subject.code.clone(),
            session: self.subject.session,
            block: segment.block,
            resistance: segment.resistance.name.clone(),
            condition: segment.condition.name.clone(),
            trial: self.at.1 + 1,
            direction: Some(direction),
            amplitude_m: segment.condition.amplitude_m,
            width_m: segment.condition.width_m,
            cursor_diameter_m: Some(self.plan.cursor.diameter_m),
            end_error_m: f64::from(direction) * error_m,
            movement_time_s: (tick - self.trial.start_tick) as f64 * self.period_s,
            errors: self.trial.errors,
            error_size_m: Some(self.trial.error_size_m),
            start_tick: Some(self.trial.start_tick),
            end_tick: Some(tick),
            scene_revision: Some(revision),
            ..FittsTrial::default()
        }
    }

    fn begin_trial(&mut self, start_tick: u64) {
        self.trial = Progress {
            start_tick,
            ..Progress::default()
        };
    }

    /// Goes on to the next trial.
    fn advance(&mut self) {
        self.at.1 += 1;
        if self.at.1 < self.plan.trials_per_segment {
            return;
        }
        self.at = (self.at.0 + 1, 0);
        self.phase = if self.segment().is_some() {
            Phase::Ready
        } else {
            Phase::Finished
        };
    }
}

#[cfg(test)]
mod tests;
