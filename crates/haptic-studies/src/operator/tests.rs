use super::super::plan::Plan;
use super::super::session::{Settings, Ticks, TrialRow};
use super::super::small_plans::{fitts_plan, perception_plan};
use super::super::trial::{Case, FittsTrial, Operator};
use super::*;
use haptic_ipc::Sample;
use haptic_lab::replay::replay;
use haptic_recording::{Entry, Mark, Metadata};

/// The trials of one segment under a resistance, in a condition, each with its ticks.
fn segment(resistance: &str, condition: &str) -> Vec<(FittsTrial, Ticks)> {
    let mut plan = fitts_plan();
    plan.practice_segments = 0;
    plan.baseline = resistance.to_owned();
    plan.resistances.retain(|one| one.name == resistance);
    plan.conditions.retain(|one| one.name == condition);
    let subject = Subject::numbered(1);
    let mut session = new_session(&Plan::Fitts(plan), &subject);
    let mut trials = Vec::new();
    run_next(&mut session, 1, &subject, |finished| {
        let TrialRow::Fitts(trial) = finished.row else {
            panic!("targets")
        };
        trials.push((*trial, finished.ticks.expect("its ticks")));
        true
    })
    .expect("it can be done");
    trials
}

fn new_session(plan: &Plan, subject: &Subject) -> Session {
    let settings = Settings {
        operator: Operator::Simulated,
        period_s: PERIOD_S,
        click_buttons: 0,
        servo: Some(setup()),
        voided: 0,
    };
    let task = Task::new(plan, 1, subject, Operator::Simulated, PERIOD_S);
    Session::new(task, subject, settings)
}

fn mean_s(trials: &[(FittsTrial, Ticks)]) -> f64 {
    trials.iter().map(|(trial, _)| trial.movement_time_s).sum::<f64>() / trials.len() as f64
}

#[test]
fn simulated_segment_repeats_and_its_recording_replays() {
    let trials = segment("high stiction", "5");
    let again = segment("high stiction", "5");
    assert_eq!(trials.len(), 8);
    assert!(trials == again);
    let rows: Vec<Sample> = trials.iter().flat_map(|(_, ticks)| ticks.rows.clone()).collect();
    replays(&trials[0].1.scene, &rows, &[]);
}

/// Every force of these ticks follows from what they were computed with.
fn replays(scene: &Scene, rows: &[Sample], marks: &[Mark]) {
    let mut entries = Vec::new();
    for row in rows {
        let of_tick = marks.iter().filter(|mark| mark.tick() == Some(row.tick));
        entries.extend(of_tick.cloned().map(Entry::Mark));
        entries.push(Entry::Row(*row, None));
    }
    let metadata = Metadata {
        server: String::new(),
        device: String::new(),
        axes: 1,
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
    let report = replay(&metadata, entries.into_iter().map(Ok)).expect("it is replayed");
    assert!(
        report.is_exact() && report.compared() + 100 > report.ticks,
        "{report:?}"
    );
}

#[test]
fn a_smaller_target_takes_longer() {
    let [small, large] = ["7", "3"].map(|condition| mean_s(&segment("baseline", condition)));
    assert!(small > 1.2 * large, "{small} s, {large} s");
}

#[test]
fn a_trial_that_cannot_be_done_ends_with_a_reason() {
    let mut plan = fitts_plan();
    for condition in &mut plan.conditions {
        condition.width_m = plan.cursor.diameter_m;
    }
    let subject = Subject::numbered(1);
    let mut session = new_session(&Plan::Fitts(plan), &subject);
    let error = run_next(&mut session, 1, &subject, |_| true)
        .expect_err("nobody hits that")
        .to_string();
    assert!(
        error.starts_with("subject 01, block ") && error.contains("no valid click within 60 s"),
        "{error}"
    );
}

/// A large difference is noticed in each case, and its recording gives the same forces.
#[test]
fn a_surface_with_much_more_friction_is_distinguished() {
    let mut plan = perception_plan();
    plan.practice_trials = 0;
    plan.interval_s = 1.6;
    for test in &mut plan.tests {
        if let Some(constant) = &mut test.constant {
            (constant.levels_n, constant.trials_per_level) = (vec![3.0], 2);
        }
        if let Some(staircase) = &mut test.staircase {
            (staircase.start_n, staircase.stop_after_trials) = (8.0, Some(2));
        }
    }
    let subject = Subject::numbered(1);
    let expected_s = trial_s(&plan);
    let mut session = new_session(&Plan::Perception(plan), &subject);
    let mut cases = Vec::new();
    while !session.is_done() {
        run_next(&mut session, 1, &subject, |finished| {
            let TrialRow::Perception(trial) = finished.row else {
                panic!("surfaces")
            };
            assert!(trial.correct, "{trial:?}");
            let ticks = finished.ticks.expect("its ticks");
            let took_s = ticks.rows.len() as f64 * PERIOD_S;
            assert!((took_s - expected_s).abs() < 1e-6, "{took_s} s, not {expected_s} s");
            if cases.is_empty() {
                assert!(ticks.marks.iter().any(|mark| matches!(mark, Mark::Scene { .. })));
                replays(&ticks.scene, &ticks.rows, &ticks.marks);
            }
            cases.push(trial.case);
            true
        })
        .expect("it is rendered");
    }
    cases.sort_unstable();
    assert_eq!(cases, [Case::A, Case::A, Case::B, Case::B, Case::C, Case::C]);
}
