//! Plans for tests.

use super::plan::{FittsPlan, PerceptionPlan, Plan, Task};

/// The built-in targeting task.
pub(crate) fn fitts_plan() -> FittsPlan {
    let Ok(Plan::Fitts(plan)) = Plan::read(Task::Fitts.built_in_plan()) else {
        panic!("a plan")
    };
    plan
}

/// The built-in perception tests.
pub(crate) fn perception_plan() -> PerceptionPlan {
    let Ok(Plan::Perception(plan)) = Plan::read(Task::Perception.built_in_plan()) else {
        panic!("a plan")
    };
    plan
}

/// Two conditions and two resistances, of two trials a segment.
pub(crate) fn small_fitts() -> String {
    let text = Task::Fitts
        .built_in_plan()
        .replace("trials_per_segment = 8", "trials_per_segment = 2");
    let (head, rest) = text
        .split_once("[[conditions]]\nname = \"3\"")
        .expect("a third condition");
    let (_, resistances) = rest.split_once("[[resistances]]").expect("resistances");
    let (two, _) = resistances.split_once("# 0.5 kg with").expect("a third resistance");
    format!("{head}[[resistances]]{two}")
}

/// Three levels once each, of short intervals.
pub(crate) fn small_perception() -> String {
    let text = Task::Perception.built_in_plan();
    let (head, _) = text.split_once("[[tests]]\ncase = \"C\"").expect("a second test");
    head.replace("[0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0]", "[0.5, 1.0, 1.5]")
        .replace("trials_per_level = 20", "trials_per_level = 1")
        .replace("practice_trials = 4", "practice_trials = 1")
        .replace("interval_s = 3 ", "interval_s = 0.8 ")
}
