//! The plan of perception tests.

use super::super::order::Order;
use super::super::trial::{Case, Method};
use super::Task;
use super::check::{PlanError, names, one_of, within};
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::{Directional, Scene};
use haptic_lab::stats::psychometric::{Level, MIN_LEVELS, by_level};
use serde::{Deserialize, Serialize};

/// Perception tests on one base surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerceptionPlan {
    /// Always [`Task::Perception`].
    pub task: Task,
    /// What people call it.
    pub name: String,
    /// Trials of practice.
    pub practice_trials: u32,
    /// How long each surface is felt, s (> 0).
    pub interval_s: f64,
    /// Time before each surface, s.
    pub gap_s: f64,
    /// Trials between two breaks.
    pub rest_every_trials: u32,
    /// Length of a break, s.
    pub rest_s: f64,
    /// Order of the tests.
    #[serde(default)]
    pub order: Order,
    /// The base surface: Karnopp's law, the same in both directions.
    pub base: Scene,
    /// The tests.
    pub tests: Vec<Test>,
}

/// A test: a case, by one of the two methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// What the comparison changes.
    pub case: Case,
    /// Constant stimuli.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constant: Option<Constant>,
    /// A staircase.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub staircase: Option<Staircase>,
}

impl Test {
    /// Its method.
    #[must_use]
    pub const fn method(&self) -> Method {
        if self.staircase.is_some() {
            Method::Staircase
        } else {
            Method::Constant
        }
    }

    /// Its largest level, N: the easiest.
    #[must_use]
    pub fn easiest_n(&self) -> f64 {
        let constant = self
            .constant
            .iter()
            .flat_map(|constant| constant.levels_n.iter().copied());
        let staircase = self.staircase.iter().map(|staircase| staircase.largest_n);
        constant.chain(staircase).fold(0.0, f64::max)
    }
}

/// Constant stimuli: every level equally often, in random order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constant {
    /// The levels, N (> 0).
    #[serde(rename = "levels_N")]
    pub levels_n: Vec<f64>,
    /// Trials at each.
    pub trials_per_level: u32,
}

/// A staircase: correct answers make it harder, wrong ones easier. A smaller level is harder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Staircase {
    /// First level, N.
    #[serde(rename = "start_N")]
    pub start_n: f64,
    /// Smallest level, N (> 0).
    #[serde(rename = "smallest_N")]
    pub smallest_n: f64,
    /// Largest level, N.
    #[serde(rename = "largest_N")]
    pub largest_n: f64,
    /// Fall of the level to a harder one, N (> 0).
    #[serde(rename = "harder_step_N")]
    pub harder_step_n: f64,
    /// Rise of the level to an easier one, N (> 0).
    #[serde(rename = "easier_step_N")]
    pub easier_step_n: f64,
    /// Correct answers in a row that make it harder.
    pub correct_before_harder: u32,
    /// Wrong answers in a row that make it easier.
    pub wrong_before_easier: u32,
    /// It ends after this number of trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_after_trials: Option<u32>,
    /// It ends after this number of turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_after_reversals: Option<u32>,
}

impl PerceptionPlan {
    /// Trials of a subject, without practice, or the most that there can be; none where a staircase has no such limit.
    #[must_use]
    pub fn trials(&self) -> Option<usize> {
        let of = |test: &Test| match (&test.constant, &test.staircase) {
            (Some(constant), _) => Some(constant.levels_n.len() * constant.trials_per_level as usize),
            (None, Some(staircase)) => staircase.stop_after_trials.map(|trials| trials as usize),
            (None, None) => None,
        };
        self.tests.iter().map(of).sum()
    }

    /// The tests' names in an order: the case, with the method where a case is there more than once.
    #[must_use]
    pub fn test_names(&self) -> Vec<String> {
        let is_alone = |test: &Test| self.tests.iter().filter(|other| other.case == test.case).count() == 1;
        let name = |test: &Test| match is_alone(test) {
            true => format!("{:?}", test.case),
            false => format!("{:?} {}", test.case, test.method().name()),
        };
        self.tests.iter().map(name).collect()
    }

    /// Static and dynamic friction of the base, N.
    #[must_use]
    pub fn base_n(&self) -> (f64, f64) {
        self.karnopp().map_or((0.0, 0.0), |law| {
            (law.static_force.positive, law.dynamic_force.positive)
        })
    }

    /// Static and dynamic friction of a comparison, N.
    #[must_use]
    pub fn comparison_n(&self, case: Case, level_n: f64) -> (f64, f64) {
        let (static_n, dynamic_n) = self.base_n();
        match case {
            Case::A => (static_n + level_n, dynamic_n + level_n),
            Case::B => (static_n + level_n, dynamic_n),
            Case::C => (static_n - level_n, dynamic_n - level_n),
        }
    }

    /// The base with other friction, N.
    #[must_use]
    pub fn surface(&self, (static_n, dynamic_n): (f64, f64)) -> Scene {
        let mut scene = self.base.clone();
        if let Friction::Karnopp(law) = &mut scene.friction {
            law.static_force = Directional::both(static_n);
            law.dynamic_force = Directional::both(dynamic_n);
        }
        scene
    }

    fn karnopp(&self) -> Option<&Karnopp> {
        match &self.base.friction {
            Friction::Karnopp(law) => Some(law),
            _ => None,
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// One is out of range, or a surface cannot be rendered.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        within("practice_trials", f64::from(self.practice_trials), 0.0, 1000.0, "")?;
        within("interval_s", self.interval_s, 0.1, 60.0, " s")?;
        within("gap_s", self.gap_s, 0.1, 60.0, " s")?;
        within(
            "rest_every_trials",
            f64::from(self.rest_every_trials),
            1.0,
            10_000.0,
            "",
        )?;
        within("rest_s", self.rest_s, 0.0, 3600.0, " s")?;
        let wrong = |error| PlanError(format!("base: {error}"));
        self.base.validate().map_err(wrong)?;
        let is_plain = self
            .karnopp()
            .is_some_and(|law| law.static_force.is_symmetric() && law.dynamic_force.is_symmetric());
        if !is_plain {
            let law = self.base.friction.law();
            return Err(PlanError(format!(
                "base: friction.law = `{law}`: karnopp is needed, with one static_force and one dynamic_force"
            )));
        }
        self.tests.iter().try_for_each(|test| self.check_test(test))?;
        // Rows say case and method alone of their test.
        names("tests", self.test_names().iter().map(String::as_str))
    }

    /// Checks that the analysis can find a threshold by each list of levels.
    ///
    /// # Errors
    /// A list has too few levels, or one of them twice.
    pub(super) fn check_levels(&self) -> Result<(), PlanError> {
        for test in &self.tests {
            let Some(constant) = &test.constant else { continue };
            let field = format!("tests.{:?}.constant.levels_N", test.case);
            let levels = by_level(constant.levels_n.iter().map(|level_n| (*level_n, false)));
            if let Some(&Level { level: level_n, .. }) = levels.iter().find(|level| level.trials > 1) {
                return Err(PlanError(format!(
                    "{field}: {level_n} N is there twice: trials_per_level says how often a level is tested"
                )));
            }
            if levels.len() < MIN_LEVELS {
                return Err(PlanError(format!(
                    "{field}: different levels: {}; the analysis needs at least {MIN_LEVELS}",
                    levels.len()
                )));
            }
        }
        Ok(())
    }

    /// Frictions that may be swapped, and levels that may be meant in another unit, for people.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        let (static_n, dynamic_n) = self.base_n();
        let swapped = (static_n < dynamic_n).then(|| {
            format!(
                "the base's static friction of {static_n} N is below its dynamic friction of {dynamic_n} N: are they \
                 swapped?"
            )
        });
        let levels = self.tests.iter().filter_map(move |test| {
            let (level_n, times) = (test.easiest_n(), test.easiest_n() / static_n);
            let field = match test.method() {
                Method::Constant => "constant.levels_N",
                Method::Staircase => "staircase.largest_N",
            };
            // Of a base without friction every level is infinitely many times that.
            (times.is_finite() && times > MANY_TIMES).then(|| {
                format!(
                    "tests.{:?}.{field} goes to {level_n} N, {times:.0} times the base's static friction of {static_n} \
                     N: is it meant in N?",
                    test.case
                )
            })
        });
        swapped.into_iter().chain(levels)
    }

    fn check_test(&self, test: &Test) -> Result<(), PlanError> {
        let place = format!("tests.{:?}", test.case);
        let level = |field: String, level_n| within(field, level_n, 1e-3, 1000.0, " N");
        match (&test.constant, &test.staircase) {
            (Some(constant), None) => {
                for (index, level_n) in constant.levels_n.iter().enumerate() {
                    level(format!("{place}.constant.levels_N[{index}]"), *level_n)?;
                }
                let count = f64::from(constant.trials_per_level);
                within(format!("{place}.constant.trials_per_level"), count, 1.0, 10_000.0, "")?;
            }
            (None, Some(staircase)) => staircase.check(&format!("{place}.staircase"))?,
            _ => return Err(one_of(&place, "constant", "staircase")),
        }
        let (level_n, (static_n, dynamic_n)) = (test.easiest_n(), self.base_n());
        if test.case == Case::B && static_n < dynamic_n {
            return Err(PlanError(format!(
                "case B: static_force = {static_n} N of the base is below its dynamic_force = {dynamic_n} N, at which \
                 the block lets go: a higher static friction would be felt less than its level says"
            )));
        }
        let base_n = static_n.min(dynamic_n);
        if test.case == Case::C && level_n > base_n {
            return Err(PlanError(format!(
                "case C: a level of {level_n} N leaves less friction than none: the base has {base_n} N"
            )));
        }
        let surface = self.surface(self.comparison_n(test.case, level_n));
        let wrong = |error| PlanError(format!("{place}, level_N = {level_n} N: {error}"));
        surface.validate().map_err(wrong)
    }
}

/// How many times the base's static friction a level is that may be meant in mN.
const MANY_TIMES: f64 = 10.0;

/// Reversals at the beginning of a staircase that do not count: it comes from far above.
pub(crate) const DROPPED_REVERSALS: u32 = 4;

impl Staircase {
    fn check(&self, place: &str) -> Result<(), PlanError> {
        let field = |name: &str| format!("{place}.{name}");
        within(field("smallest_N"), self.smallest_n, 1e-3, 1000.0, " N")?;
        within(field("largest_N"), self.largest_n, self.smallest_n, 1000.0, " N")?;
        within(field("start_N"), self.start_n, self.smallest_n, self.largest_n, " N")?;
        within(field("harder_step_N"), self.harder_step_n, 1e-3, 1000.0, " N")?;
        within(field("easier_step_N"), self.easier_step_n, 1e-3, 1000.0, " N")?;
        for (name, count) in [
            ("correct_before_harder", self.correct_before_harder),
            ("wrong_before_easier", self.wrong_before_easier),
        ] {
            within(field(name), f64::from(count), 1.0, 10.0, "")?;
        }
        for (name, count, least) in [
            ("stop_after_trials", self.stop_after_trials, 1),
            // The first reversals are left out of the mean, and two are the fewest that have one.
            ("stop_after_reversals", self.stop_after_reversals, DROPPED_REVERSALS + 2),
        ] {
            if let Some(count) = count {
                within(field(name), f64::from(count), f64::from(least), 10_000.0, "")?;
            }
        }
        if self.stop_after_trials.is_none() && self.stop_after_reversals.is_none() {
            return Err(PlanError(format!(
                "{place}: `stop_after_trials` or `stop_after_reversals` is needed"
            )));
        }
        Ok(())
    }
}
