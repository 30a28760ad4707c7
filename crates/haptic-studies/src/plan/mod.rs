//! Plans: what a study consists of, as data.

mod check;
mod fitts;
mod perception;

use super::order::{Order, places};
use super::subject::Subject;
pub use check::PlanError;
pub use fitts::{Condition, Cursor, FittsPlan, MountedBlock, Resistance, RigMapping};
pub(crate) use perception::DROPPED_REVERSALS;
pub use perception::{Constant, PerceptionPlan, Staircase, Test};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What a study consists of.
#[derive(Clone, Debug, PartialEq)]
pub enum Plan {
    /// Targets to be clicked.
    Fitts(FittsPlan),
    /// Surfaces to distinguish.
    Perception(PerceptionPlan),
}

impl Plan {
    /// Reads a plan, and checks it.
    ///
    /// # Errors
    /// It is not a plan, a value of it is out of range, or the analysis could not use its trials.
    pub fn read(text: &str) -> Result<Self, PlanError> {
        let plan = Self::of_study(text)?;
        if let Self::Perception(plan) = &plan {
            plan.check_levels()?;
        }
        Ok(plan)
    }

    /// Reads the plan of a study that was made, maybe by an earlier version, which did not ask what the analysis needs.
    ///
    /// # Errors
    /// It is not a plan, or a value of it is out of range.
    pub(crate) fn of_study(text: &str) -> Result<Self, PlanError> {
        #[derive(Deserialize)]
        struct Head {
            task: Task,
        }
        match parse::<Head>(text)?.task {
            Task::Fitts => {
                let plan: FittsPlan = parse(text)?;
                plan.check()?;
                Ok(Self::Fitts(plan))
            }
            Task::Perception => {
                let plan: PerceptionPlan = parse(text)?;
                plan.check()?;
                Ok(Self::Perception(plan))
            }
        }
    }

    /// The task.
    #[must_use]
    pub const fn task(&self) -> Task {
        match self {
            Self::Fitts(_) => Task::Fitts,
            Self::Perception(_) => Task::Perception,
        }
    }

    /// What a subject does in an order: the names of the resistances, or of the tests.
    #[must_use]
    pub fn ordered_names(&self) -> Vec<String> {
        match self {
            Self::Fitts(plan) => plan.resistance_names(),
            Self::Perception(plan) => plan.test_names(),
        }
    }

    /// The same in the order in which a subject does them; before it, the targeting task has its baseline.
    #[must_use]
    pub fn order_of(&self, seed: u64, subject: &Subject) -> Vec<String> {
        let names = self.ordered_names();
        let places = places(self.order(), &names, seed, subject);
        places.into_iter().map(|place| names[place].clone()).collect()
    }

    /// Trials of a subject, without practice, or the most that there can be; none where a staircase has no such limit.
    #[must_use]
    pub fn trials(&self) -> Option<usize> {
        match self {
            // The baseline comes first, and once more among the resistances.
            Self::Fitts(plan) => {
                let segments = plan.conditions.len() * (1 + plan.resistances.len());
                Some(segments * plan.trials_per_segment as usize)
            }
            Self::Perception(plan) => plan.trials(),
        }
    }

    /// What may be meant otherwise, for people.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        match self {
            Self::Fitts(_) => Vec::new(),
            Self::Perception(plan) => plan.notes().collect(),
        }
    }

    /// How that order comes about.
    #[must_use]
    pub const fn order(&self) -> Order {
        match self {
            Self::Fitts(plan) => plan.order,
            Self::Perception(plan) => plan.order,
        }
    }

    /// The plan's name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Fitts(plan) => &plan.name,
            Self::Perception(plan) => &plan.name,
        }
    }
}

/// What to write for a coupling of the rig.
const NUMBERS: &str =
    "\na plan has the numbers that commissioning printed: coupling = { stiffness = .., damping = .. }";

fn parse<T: DeserializeOwned>(text: &str) -> Result<T, PlanError> {
    toml::from_str(text).map_err(|error| {
        let message = error.to_string().trim_end().to_owned();
        // As a scene may have it, which is of one rig: a study is the same on each.
        let is_of_rig = error.message().ends_with("\"rig\", expected struct Coupling");
        PlanError(if is_of_rig { message + NUMBERS } else { message })
    })
}

/// The task of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Targets to be clicked.
    Fitts,
    /// Surfaces to distinguish.
    Perception,
}

impl Task {
    /// All tasks.
    pub const ALL: [Self; 2] = [Self::Fitts, Self::Perception];

    /// Its name, in plans and in names of files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fitts => "fitts",
            Self::Perception => "perception",
        }
    }

    /// The plan that every program has for it, as TOML.
    #[must_use]
    pub const fn built_in_plan(self) -> &'static str {
        match self {
            Self::Fitts => include_str!("../../../../studies/fitts.toml"),
            Self::Perception => include_str!("../../../../studies/perception.toml"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_plans_are_those_of_the_paper() {
        let Ok(Plan::Fitts(fitts)) = Plan::read(Task::Fitts.built_in_plan()) else {
            panic!("a plan")
        };
        assert_eq!((fitts.conditions.len(), fitts.resistances.len()), (9, 5));
        let mm = |value: f64| (value * 1e3).round();
        let printed: Vec<(f64, f64)> = fitts
            .conditions
            .iter()
            .map(|condition| (mm(condition.amplitude_m), mm(condition.width_m)))
            .collect();
        let amplitudes = [342.0, 450.0, 570.0];
        let table = amplitudes.map(|amplitude| [18.0, 60.0, 102.0].map(|width| (amplitude, width)));
        assert_eq!(printed, table.concat());
        assert!(matches!(
            Plan::read(Task::Perception.built_in_plan()),
            Ok(Plan::Perception(_))
        ));
    }

    #[test]
    fn a_wrong_plan_is_reported_by_field_value_limit_and_unit() {
        let fitts = Task::Fitts.built_in_plan();
        let perception = Task::Perception.built_in_plan();
        for (text, was, is, message) in [
            (
                fitts,
                "gain = 3",
                "gain = 0",
                "rig.gain = 0 is out of range: 0.01 to 100",
            ),
            (
                fitts,
                "diameter_m = 0.006",
                "diameter_m = 0.02",
                "cursor.diameter_m = 0.02 m is out of range: 0 m to 0.017 m",
            ),
            (
                fitts,
                "gain = 3",
                "gain = 2",
                "conditions.9: its targets take 0.168 m of the handle to either side of rig.center_m, and rig.range_m leaves \
                 0.12 m: raise rig.gain to 2.8 or more",
            ),
            (
                fitts,
                "center_m = 0",
                "center_m = 0.12",
                "conditions.9: its targets take 0.112 m of the handle to either side of rig.center_m, and rig.range_m leaves \
                 0 m: move rig.center_m towards the middle of rig.range_m",
            ),
            (fitts, "name = \"2\"", "name = \"1\"", "conditions: duplicate name `1`"),
            (
                fitts,
                "baseline = \"baseline\"",
                "baseline = \"none\"",
                "baseline = `none` is not the name of a resistance; there are baseline, real, simulated",
            ),
            (
                fitts,
                "[resistances.mounted]",
                "[resistances.scene.friction]\nlaw = \"viscous\"\nviscous = 1\n[resistances.mounted]",
                "resistances.real: either `scene` or `mounted` is needed, and not both",
            ),
            (
                fitts,
                "viscous = 35",
                "viscous = -1",
                "resistances.viscous: viscous = -1 N s/m is out of range",
            ),
            (fitts, "rest_s = 60", "rest_h = 60", "unknown field `rest_h`"),
            (fitts, "task = \"fitts\"", "task = \"golf\"", "unknown variant `golf`"),
            (
                perception,
                "levels_N = [0.1, ",
                "levels_N = [4.1, ",
                "case C: a level of 4.1 N leaves less friction than none: the base has 3.5 N",
            ),
            (
                perception,
                "levels_N = [0.1, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3]",
                "levels_N = [0.1, 0.2]",
                "tests.C.constant.levels_N: different levels: 2; the analysis needs at least 3",
            ),
            (
                perception,
                "levels_N = [0.1, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3]",
                "levels_N = []",
                "tests.C.constant.levels_N: different levels: 0; the analysis needs at least 3",
            ),
            (
                perception,
                "levels_N = [0.1, 0.2, 0.3,",
                "levels_N = [0.1, 0.3, 0.3,",
                "tests.C.constant.levels_N: 0.3 N is there twice",
            ),
            (
                perception,
                "static_force = 4.0",
                "static_force = 3.0",
                "case B: static_force = 3 N of the base is below its dynamic_force = 3.5 N",
            ),
            (
                perception,
                "correct_before_harder = 2",
                "correct_before_harder = 0",
                "tests.B.staircase.correct_before_harder = 0 is out of range: 1 to 10",
            ),
            (
                perception,
                "stop_after_reversals = 14",
                "stop_after_reversals = 5",
                "tests.B.staircase.stop_after_reversals = 5 is out of range: 6 to 10000",
            ),
            (
                perception,
                "stop_after_trials = 120\nstop_after_reversals = 14",
                "",
                "tests.B.staircase: `stop_after_trials` or `stop_after_reversals` is needed",
            ),
            (
                perception,
                "coupling = { stiffness = 25000, damping = 10 }",
                "coupling = \"rig\"",
                "a plan has the numbers that commissioning printed: coupling = { stiffness",
            ),
            (
                fitts,
                "coupling = { stiffness = 25000, damping = 10 }",
                "coupling = \"rig\"",
                "a plan has the numbers that commissioning printed: coupling = { stiffness",
            ),
            (
                perception,
                "case = \"A\"",
                "case = \"C\"",
                "tests: duplicate name `C constant`",
            ),
        ] {
            let changed = text.replacen(was, is, 1);
            assert_ne!(changed, text, "{was}");
            let error = Plan::read(&changed).expect_err(message).to_string();
            assert!(error.contains(message), "{error}\n{message}");
        }
        // A study of it may have been made before.
        let few = perception.replace("[0.1, 0.2, 0.3, 0.4, 0.6, 0.9, 1.3]", "[0.1]");
        assert!(Plan::read(&few).is_err() && Plan::of_study(&few).is_ok());
        // By two methods, a case is two tests.
        let both = perception.replace("case = \"B\"", "case = \"A\"");
        assert!(Plan::read(&both).is_ok_and(|plan| plan.ordered_names()[2] == "A staircase"));
    }

    #[test]
    fn levels_in_mn_and_swapped_frictions_are_noted() {
        let notes = |was: &str, is: &str| {
            let changed = Task::Perception.built_in_plan().replacen(was, is, 1);
            Plan::read(&changed).expect("a plan").notes()
        };
        assert!(notes("", "").is_empty());
        assert!(notes("1.4, 2.0]", "1.4, 40]").is_empty());
        let base = "times the base's static friction of 4 N: is it meant in N?";
        let many = format!("tests.A.constant.levels_N goes to 300 N, 75 {base}");
        assert_eq!(notes("1.4, 2.0]", "100, 300]"), [many]);
        let many = format!("tests.B.staircase.largest_N goes to 800 N, 200 {base}");
        assert_eq!(notes("largest_N = 8.0", "largest_N = 800"), [many]);
        // Of case B it is refused.
        let perception = Task::Perception.built_in_plan().replace("case = \"B\"", "case = \"A\"");
        let plan = Plan::read(&perception.replacen("static_force = 4", "static_force = 3", 1)).expect("a plan");
        let swapped = "the base's static friction of 3 N is below its dynamic friction of 3.5 N: are they swapped?";
        assert_eq!(plan.notes(), [swapped]);
    }
}
