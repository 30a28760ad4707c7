use super::super::plan::{BUILT_IN_PLANS, PerceptionPlan, Plan};
use super::super::trial::{Case, Operator};
use super::*;
use crate::recording::{Entry, Metadata};
use crate::replay::replay;

fn fitts_plan() -> FittsPlan {
    let Ok(Plan::Fitts(plan)) = Plan::read(BUILT_IN_PLANS[0].1) else {
        panic!("a plan")
    };
    plan
}

fn perception_plan() -> PerceptionPlan {
    let Ok(Plan::Perception(plan)) = Plan::read(BUILT_IN_PLANS[1].1) else {
        panic!("a plan")
    };
    plan
}

/// The trials of one segment under a resistance, in a condition.
fn segment(resistance: &str, condition: &str, constants: &Constants) -> Vec<Done<FittsTrial>> {
    let mut plan = fitts_plan();
    plan.practice_segments = 0;
    plan.baseline = resistance.to_owned();
    plan.resistances.retain(|one| one.name == resistance);
    plan.conditions.retain(|one| one.name == condition);
    let subject = Subject::numbered(1);
    let mut session = FittsSession::new(&plan, 1, &subject, Operator::Simulated, PERIOD_S);
    let mut trials = Vec::new();
    run_segment(&mut session, &plan, constants, 1, &subject, |done| {
        trials.push(done);
        true
    })
    .expect("it can be done");
    trials
}

fn mean_s(trials: &[Done<FittsTrial>]) -> f64 {
    trials.iter().map(|done| done.trial.movement_time_s).sum::<f64>() / trials.len() as f64
}

#[test]
fn a_segment_is_the_same_again_and_its_recording_gives_the_same_forces() {
    let constants = Constants::default();
    let trials = segment("high stiction", "5", &constants);
    let again = segment("high stiction", "5", &constants);
    assert_eq!(trials.len(), 8);
    for (one, other) in trials.iter().zip(&again) {
        assert_eq!((&one.trial, &one.entries), (&other.trial, &other.entries));
    }
    let entries: Vec<Entry> = trials.iter().flat_map(|done| done.entries.clone()).collect();
    replays(&trials[0].scene, &entries);
}

/// Every force of these ticks follows from what they were computed with.
fn replays(scene: &Scene, entries: &[Entry]) {
    let metadata = Metadata {
        server: String::new(),
        device: String::new(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: scene.clone(),
        servo: Some(setup()),
        recorded_by: None,
        notes: None,
        configuration: None,
    };
    let report = replay(&metadata, entries.iter().cloned().map(Ok)).expect("it is replayed");
    assert!(
        report.is_exact() && report.compared() + 100 > report.ticks,
        "{report:?}"
    );
}

#[test]
fn a_smaller_target_takes_longer() {
    let constants = Constants::default();
    let [small, large] = ["7", "3"].map(|condition| mean_s(&segment("baseline", condition, &constants)));
    assert!(small > 1.2 * large, "{small} s, {large} s");
}

#[test]
fn a_trial_that_cannot_be_done_ends_with_a_reason() {
    let mut constants = Constants::default();
    constants.set("visual_noise_m", 0.1).expect("in range");
    constants.set("endpoint_noise_s", 0.3).expect("in range");
    let plan = fitts_plan();
    let subject = Subject::numbered(1);
    let mut session = FittsSession::new(&plan, 1, &subject, Operator::Simulated, PERIOD_S);
    let mut result = Ok(());
    while result.is_ok() && session.segment().is_some() {
        result = run_segment(&mut session, &plan, &constants, 1, &subject, |_| true);
    }
    let error = result.expect_err("nobody hits that").to_string();
    assert!(
        error.starts_with("subject 01, block ") && error.contains("no valid click within 60 s"),
        "{error}"
    );
}

#[test]
fn one_who_feels_without_noise_tells_every_change_apart() {
    let mut plan = perception_plan();
    plan.practice_trials = 0;
    plan.interval_s = 1.6;
    for test in &mut plan.tests {
        if let Some(constant) = &mut test.constant {
            constant.levels_n = vec![0.3];
            constant.trials_per_level = 2;
        }
        if let Some(staircase) = &mut test.staircase {
            (staircase.start_n, staircase.stop_after_trials) = (0.6, Some(2));
        }
    }
    let mut constants = Constants::default();
    for name in ["sliding_noise", "breakaway_noise"] {
        constants.set(name, 0.0).expect("in range");
    }
    let subject = Subject::numbered(1);
    let mut session = PerceptionSession::new(&plan, 1, &subject, Operator::Simulated, PERIOD_S);
    let mut cases = Vec::new();
    while let Some(done) = run_trial(&mut session, &plan.base, &constants, 1, &subject).expect("it is rendered") {
        assert!(done.trial.correct, "{:?}", done.trial);
        if cases.is_empty() {
            replays(&done.scene, &done.entries);
        }
        cases.push(done.trial.case);
    }
    cases.sort_unstable();
    assert_eq!(cases, [Case::A, Case::A, Case::B, Case::B, Case::C, Case::C]);
}

#[test]
fn a_constant_is_set_by_its_name_and_within_its_range() {
    let mut constants = Constants::default();
    constants.set("visual_delay_s", 0.2).expect("in range");
    assert_eq!(constants.get("visual_delay_s"), Some(0.2));
    let error = constants.set("visual_delay_s", 3.0).expect_err("too long").to_string();
    assert_eq!(error, "visual_delay_s = 3 is out of range: 0.01 to 1");
    let error = constants.set("delay", 0.2).expect_err("unknown").to_string();
    assert!(
        error.contains("`delay` is not a constant of the operator; there are arm_mass_kg, "),
        "{error}"
    );
    for constant in Constants::ALL {
        assert_eq!(Constants::default().get(constant.name), Some(constant.usual));
        assert!((constant.low..=constant.high).contains(&constant.usual), "{constant:?}");
    }
}
