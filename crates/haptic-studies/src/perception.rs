//! The perception tests as a state machine.
//!
//! ```text
//! Ready --begin--> gap -> interval 1 -> gap -> interval 2 -> question --answer--> Ready (a break, the next trial) ... Finished
//! ```
//!
//! It is blind: what the subject sees is a [`Phase`], which does not know what is rendered; only the rig
//! learns what is rendered, by [`surface`](PerceptionSession::surface).

mod staircase;

use super::order::places;
use super::plan::{PerceptionPlan, Test};
use super::random::{Purpose, Random};
use super::subject::{StudyMismatch, Subject, compare};
use super::trial::{Case, Operator, PerceptionTrial};
use haptic_core::Scene;
use staircase::Levels;

/// The interval that had more friction, by the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The first.
    First = 1,
    /// The second.
    Second,
}

/// Where a trial is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// A trial can begin, after a break where one is offered.
    Ready,
    /// The surface of the first (1) or the second (2) interval is on its way.
    Gap(u8),
    /// The first (1) or the second (2) surface is felt.
    Feel(u8),
    /// Which had more friction?
    Question,
    /// All is done.
    Finished,
}

/// The trial that is done now, or next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentTrial {
    /// The test's number in the plan, from 0.
    pub test: usize,
    /// Its case.
    pub case: Case,
    /// Whether it is for practice: its row is kept apart.
    pub is_practice: bool,
    /// Trial of the test, from 1.
    pub trial: u32,
    /// Size of the change, N.
    pub level_n: f64,
    /// Whether the first interval has the comparison.
    pub comparison_first: bool,
}

/// A subject's perception tests.
#[derive(Debug)]
pub struct PerceptionSession {
    plan: PerceptionPlan,
    seed: u64,
    subject: Subject,
    operator: Operator,
    period_s: f64,
    /// The tests by their numbers in the plan, in the order in which they are done.
    order: Vec<usize>,
    practice_done: u32,
    /// The test in that order, and its levels.
    at: usize,
    levels: Levels,
    done: u32,
    phase: Phase,
    phase_tick: u64,
    start_tick: u64,
}

impl PerceptionSession {
    /// One that nobody has begun. A tick takes `period_s`, s.
    #[must_use]
    pub fn new(plan: &PerceptionPlan, seed: u64, subject: &Subject, operator: Operator, period_s: f64) -> Self {
        let order = places(plan.order, &plan.test_names(), seed, subject);
        let levels = levels(plan, seed, subject, order[0]);
        Self {
            plan: plan.clone(),
            seed,
            subject: subject.clone(),
            operator,
            period_s,
            order,
            practice_done: 0,
            at: 0,
            levels,
            done: 0,
            phase: Phase::Ready,
            phase_tick: 0,
            start_tick: 0,
        }
    }

    /// Goes on after these rows: first those of practice.
    ///
    /// # Errors
    /// They are not rows of this subject in this study.
    pub fn resume(&mut self, practice: &[PerceptionTrial], trials: &[PerceptionTrial]) -> Result<(), StudyMismatch> {
        for (rows, is_practice) in [(practice, true), (trials, false)] {
            for (row, trial) in (1..).zip(rows) {
                let expected = self.upcoming().filter(|upcoming| upcoming.is_practice == is_practice);
                let [case, number, level, first] = expected.map_or_else(
                    || ["no row"; 4].map(str::to_owned),
                    |upcoming| {
                        [
                            format!("{:?}", upcoming.case),
                            upcoming.trial.to_string(),
                            upcoming.level_n.to_string(),
                            upcoming.comparison_first.to_string(),
                        ]
                    },
                );
                let cells = [
                    ("subject", trial.subject.clone(), self.subject.code.clone()),
                    ("case", format!("{:?}", trial.case), case),
                    ("trial", trial.trial.to_string(), number),
                    ("level_N", trial.level_n.to_string(), level),
                    ("comparison_first", trial.comparison_first.to_string(), first),
                ];
                compare(&self.subject.code, row, &cells)?;
                self.advance(trial.correct);
            }
        }
        Ok(())
    }

    fn test(&self) -> Option<(usize, &Test)> {
        let number = *self.order.get(self.at)?;
        Some((number, self.plan.tests.get(number)?))
    }

    /// The trial that is done now, or next. Not for the subject.
    #[must_use]
    pub fn upcoming(&self) -> Option<CurrentTrial> {
        let (number, test) = self.test()?;
        let is_practice = self.practice_done < self.plan.practice_trials;
        let (trial, level_n) = if is_practice {
            (self.practice_done + 1, test.easiest_n())
        } else {
            (self.levels.done() + 1, self.levels.level_n()?)
        };
        let item = (u64::from(is_practice) << 63) | ((number as u64) << 32) | u64::from(trial);
        let coin = Random::new(self.seed, self.subject.number, Purpose::Interval, item).below(2);
        Some(CurrentTrial {
            test: number,
            case: test.case,
            is_practice,
            trial,
            level_n,
            comparison_first: coin == 1,
        })
    }

    /// Trials done, practice included, and the most that there can be; none where a staircase has no such limit.
    #[must_use]
    pub fn progress(&self) -> (usize, Option<usize>) {
        let done = (self.done + self.practice_done) as usize;
        // A staircase may have stopped early.
        let most = match self.upcoming() {
            None => Some(done),
            Some(_) => self.plan.trials().map(|most| most + self.plan.practice_trials as usize),
        };
        (done, most)
    }

    /// Rows of practice that are done, and rows of trials.
    #[must_use]
    pub fn rows(&self) -> (u32, u32) {
        (self.practice_done, self.done)
    }

    /// Where the trial is.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Length of the break that is offered, s; 0 where there is none.
    #[must_use]
    pub fn rest_s(&self) -> f64 {
        let rests = self.phase == Phase::Ready && self.done > 0;
        if rests && self.done.is_multiple_of(self.plan.rest_every_trials) {
            self.plan.rest_s
        } else {
            0.0
        }
    }

    /// What the rig renders, or changes to in a gap: the base between two trials, nothing at the end. Not for the
    /// subject.
    #[must_use]
    pub fn surface(&self) -> Option<Scene> {
        let upcoming = self.upcoming()?;
        let is_comparison = match self.phase {
            Phase::Gap(interval) | Phase::Feel(interval) => (interval == 1) == upcoming.comparison_first,
            _ => false,
        };
        Some(if is_comparison {
            let forces = self.plan.comparison_n(upcoming.case, upcoming.level_n);
            self.plan.surface(forces)
        } else {
            self.plan.base.clone()
        })
    }

    /// Begins a trial at a tick. Without effect where one is under way.
    pub fn begin(&mut self, tick: u64) {
        if self.phase == Phase::Ready {
            self.enter(Phase::Gap(1), tick);
            self.start_tick = tick;
        }
    }

    /// Breaks the trial off. It is done again, from its first interval, after [`begin`](Self::begin).
    pub fn pause(&mut self) {
        if self.phase != Phase::Finished {
            self.phase = Phase::Ready;
        }
    }

    /// Advances time to a tick.
    pub fn step(&mut self, tick: u64) {
        let gone_s = tick.saturating_sub(self.phase_tick) as f64 * self.period_s;
        // Half a tick of rounding.
        let is_over = |length_s: f64| gone_s > length_s - 0.5 * self.period_s;
        match self.phase {
            Phase::Gap(interval) if is_over(self.plan.gap_s) => {
                self.enter(Phase::Feel(interval), tick);
                if interval == 1 {
                    self.start_tick = tick;
                }
            }
            Phase::Feel(1) if is_over(self.plan.interval_s) => self.enter(Phase::Gap(2), tick),
            Phase::Feel(_) if is_over(self.plan.interval_s) => self.enter(Phase::Question, tick),
            _ => {}
        }
    }

    /// Takes an answer at a tick: the trial's row, or nothing where no question is open. Keep the row before the next
    /// trial begins.
    pub fn answer(&mut self, answer: Answer, tick: u64) -> Option<PerceptionTrial> {
        if self.phase != Phase::Question {
            return None;
        }
        let upcoming = self.upcoming()?;
        let (_, test) = self.test()?;
        let (base_static_n, base_dynamic_n) = self.plan.base_n();
        let (comparison_static_n, comparison_dynamic_n) = self.plan.comparison_n(upcoming.case, upcoming.level_n);
        // In case C the base has more friction.
        let is_first_more = upcoming.comparison_first == (upcoming.case != Case::C);
        let correct = is_first_more == (answer == Answer::First);
        let response_time_s = tick.saturating_sub(self.phase_tick) as f64 * self.period_s;
        let mut row = PerceptionTrial {
            operator: Some(self.operator),
            subject: self.subject.code.clone(),
            session: self.subject.session,
            case: upcoming.case,
            method: test.method(),
            trial: upcoming.trial,
            base_static_n,
            base_dynamic_n,
            comparison_static_n,
            comparison_dynamic_n,
            level_n: upcoming.level_n,
            comparison_first: upcoming.comparison_first,
            answer: answer as u8,
            correct,
            response_time_s: Some(response_time_s),
            reversal: false,
            start_tick: Some(self.start_tick),
            end_tick: Some(tick),
            voided: 0,
            recording: None,
        };
        row.reversal = self.advance(correct);
        Some(row)
    }

    fn enter(&mut self, phase: Phase, tick: u64) {
        self.phase = phase;
        self.phase_tick = tick;
    }

    /// Goes on to the next trial; returns whether a staircase turned.
    fn advance(&mut self, correct: bool) -> bool {
        self.phase = Phase::Ready;
        if self.practice_done < self.plan.practice_trials {
            self.practice_done += 1;
            return false;
        }
        self.done += 1;
        let turned = self.levels.answer(correct);
        if self.levels.level_n().is_none() {
            self.at += 1;
            match self.order.get(self.at) {
                Some(number) => self.levels = levels(&self.plan, self.seed, &self.subject, *number),
                None => self.phase = Phase::Finished,
            }
        }
        turned
    }
}

/// The levels of a test, from its beginning.
fn levels(plan: &PerceptionPlan, seed: u64, subject: &Subject, number: usize) -> Levels {
    let order = Random::new(seed, subject.number, Purpose::Order, number as u64 + 1);
    Levels::new(&plan.tests[number], order)
}

#[cfg(test)]
mod tests;
