//! The levels of a test: constant stimuli, or a staircase (Levitt 1971, "Transformed up-down methods in
//! psychoacoustics").

use super::super::plan::{Staircase, Test};
use super::super::random::Random;

/// The levels of a test, one after the other.
#[derive(Debug)]
pub(super) enum Levels {
    /// In an order that is drawn before.
    Constant { levels_n: Vec<f64>, done: u32 },
    /// By the answers.
    Staircase(Climb),
}

/// A staircase under way.
#[derive(Debug)]
pub(super) struct Climb {
    rule: Staircase,
    level_n: f64,
    /// Answers in a row since the level last changed.
    correct: u32,
    wrong: u32,
    /// Whether it last became harder.
    went_harder: Option<bool>,
    done: u32,
    reversals: u32,
}

impl Levels {
    pub(super) fn new(test: &Test, mut order: Random) -> Self {
        if let Some(rule) = &test.staircase {
            return Self::Staircase(Climb {
                rule: rule.clone(),
                level_n: rule.start_n,
                correct: 0,
                wrong: 0,
                went_harder: None,
                done: 0,
                reversals: 0,
            });
        }
        let levels = test.constant.iter().flat_map(|constant| {
            let each = constant.trials_per_level as usize;
            constant
                .levels_n
                .iter()
                .flat_map(move |level_n| std::iter::repeat_n(*level_n, each))
        });
        let mut levels_n: Vec<f64> = levels.collect();
        order.shuffle(&mut levels_n);
        Self::Constant { levels_n, done: 0 }
    }

    /// Trials done.
    pub(super) fn done(&self) -> u32 {
        match self {
            Self::Constant { done, .. } => *done,
            Self::Staircase(climb) => climb.done,
        }
    }

    /// The level of the next trial, N; none at the end.
    pub(super) fn level_n(&self) -> Option<f64> {
        match self {
            Self::Constant { levels_n, done } => levels_n.get(*done as usize).copied(),
            Self::Staircase(climb) => (!climb.is_over()).then_some(climb.level_n),
        }
    }

    /// Takes an answer; returns whether the staircase turned.
    pub(super) fn answer(&mut self, correct: bool) -> bool {
        match self {
            Self::Constant { done, .. } => {
                *done += 1;
                false
            }
            Self::Staircase(climb) => climb.answer(correct),
        }
    }
}

impl Climb {
    fn is_over(&self) -> bool {
        let reached = |limit: Option<u32>, count| limit.is_some_and(|limit| count >= limit);
        reached(self.rule.stop_after_trials, self.done) || reached(self.rule.stop_after_reversals, self.reversals)
    }

    fn answer(&mut self, correct: bool) -> bool {
        self.done += 1;
        if correct {
            (self.correct, self.wrong) = (self.correct + 1, 0);
        } else {
            (self.correct, self.wrong) = (0, self.wrong + 1);
        }
        let goes_harder = if self.correct >= self.rule.correct_before_harder {
            true
        } else if self.wrong >= self.rule.wrong_before_easier {
            false
        } else {
            return false;
        };
        (self.correct, self.wrong) = (0, 0);
        let step_n = if goes_harder {
            -self.rule.harder_step_n
        } else {
            self.rule.easier_step_n
        };
        // Rounded to a millionth of a newton, so that steps there and back end at the same level.
        let level_n = ((self.level_n + step_n) * 1e6).round() / 1e6;
        self.level_n = level_n.clamp(self.rule.smallest_n, self.rule.largest_n);
        // At the end of its range the level stays, and the direction counts all the same.
        let turned = self.went_harder.is_some_and(|went_harder| went_harder != goes_harder);
        self.went_harder = Some(goes_harder);
        self.reversals += u32::from(turned);
        turned
    }
}
