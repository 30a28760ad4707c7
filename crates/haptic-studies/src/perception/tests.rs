use super::super::small_plans::perception_plan;
use super::super::trial::Method;
use super::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Three levels three times each, and a staircase of at most twelve trials.
fn small() -> PerceptionPlan {
    let mut plan = perception_plan();
    for test in &mut plan.tests {
        if let Some(constant) = &mut test.constant {
            constant.levels_n.truncate(3);
            constant.trials_per_level = 3;
        }
        if let Some(staircase) = &mut test.staircase {
            staircase.stop_after_trials = Some(12);
        }
    }
    plan
}

fn session(plan: &PerceptionPlan) -> PerceptionSession {
    PerceptionSession::new(plan, 5, &Subject::numbered(2), Operator::Human, 1e-3)
}

/// Goes through the intervals of a trial to its question; returns the tick.
fn to_question(session: &mut PerceptionSession, mut tick: u64) -> u64 {
    session.begin(tick);
    while session.phase() != Phase::Question {
        tick += 1;
        session.step(tick);
    }
    tick
}

fn answer_that_is(correct: bool, upcoming: &CurrentTrial) -> Answer {
    let is_first_more = upcoming.comparison_first == (upcoming.case != Case::C);
    if is_first_more == correct {
        Answer::First
    } else {
        Answer::Second
    }
}

/// The rows of a subject who answers so, in turn.
fn rows(plan: &PerceptionPlan, answers: impl Fn(usize) -> bool) -> Vec<PerceptionTrial> {
    let mut session = session(plan);
    let (mut rows, mut tick) = (Vec::new(), 0);
    while let Some(upcoming) = session.upcoming() {
        tick = to_question(&mut session, tick);
        let answer = answer_that_is(answers(rows.len()), &upcoming);
        rows.push(session.answer(answer, tick + 400).expect("a question is open"));
        tick += 1000;
    }
    assert_eq!(session.phase(), Phase::Finished);
    rows
}

#[test]
fn a_trial_is_two_intervals_by_ticks_and_an_answer() {
    let mut session = session(&small());
    let mut seen = Vec::new();
    session.begin(100);
    for tick in 100..7200 {
        session.step(tick);
        let phase = session.phase();
        if seen.last().is_none_or(|(_, last)| *last != phase) {
            seen.push((tick, phase));
        }
    }
    use Phase::{Feel, Gap, Question};
    assert_eq!(
        seen,
        [
            (100, Gap(1)),
            (600, Feel(1)),
            (3600, Gap(2)),
            (4100, Feel(2)),
            (7100, Question)
        ]
    );
    let row = session.answer(Answer::Second, 7350).expect("a question is open");
    assert_eq!((row.answer, row.start_tick, row.end_tick), (2, Some(600), Some(7350)));
    assert_eq!(row.response_time_s, Some(0.25));
    assert_eq!(session.answer(Answer::First, 7400), None, "no question is open");
}

#[test]
fn the_rig_gets_the_surface_and_a_pause_does_the_trial_again() {
    let mut session = session(&small());
    let upcoming = session.upcoming().expect("a trial");
    assert!(upcoming.is_practice && session.surface().as_ref() == Some(&session.plan.base));
    session.begin(0);
    let first = session.surface().expect("a surface");
    assert_eq!(first != session.plan.base, upcoming.comparison_first);
    session.step(500);
    session.step(3500);
    let second = session.surface().expect("a surface");
    assert_eq!(second != session.plan.base, !upcoming.comparison_first);
    session.pause();
    assert_eq!((session.phase(), session.rest_s()), (Phase::Ready, 0.0));
    assert_eq!(session.upcoming(), Some(upcoming));
}

#[test]
fn constant_stimuli_come_equally_often_in_every_case() {
    let plan = small();
    let rows = rows(&plan, |_| true);
    let mut counts = BTreeMap::new();
    for row in rows.iter().skip(4).filter(|row| row.method == Method::Constant) {
        let (base, comparison) = (row.base_dynamic_n, row.comparison_dynamic_n);
        assert!((comparison - base).abs() - row.level_n < 1e-12 && (comparison > base) == (row.case == Case::A));
        assert_eq!(
            row.answer == 1,
            row.comparison_first == (row.case == Case::A),
            "the one with more friction"
        );
        *counts.entry((row.case, row.level_n.to_bits())).or_insert(0) += 1;
    }
    assert_eq!(counts.len(), 6);
    assert!(counts.values().all(|count| *count == 3), "{counts:?}");
}

/// Derived by hand: two correct answers, and the level falls by 0.5 N; one wrong, and it rises by 1 N. It ends at the
/// third reversal, before its twenty trials.
#[test]
fn a_staircase_follows_its_rule_and_ends_at_trials_or_reversals() {
    let mut plan = perception_plan();
    plan.practice_trials = 0;
    plan.tests.retain(|test| test.case == Case::B);
    let rule = plan.tests[0].staircase.as_mut().expect("a staircase");
    (rule.start_n, rule.largest_n, rule.smallest_n) = (3.0, 4.0, 0.5);
    (rule.harder_step_n, rule.easier_step_n) = (0.5, 1.0);
    (rule.stop_after_trials, rule.stop_after_reversals) = (Some(20), Some(3));
    let answers = [true, true, true, true, false, false, true, false, true, true, false];
    let done = rows(&plan, |index| answers[index]);
    let levels: Vec<f64> = done.iter().map(|row| row.level_n).collect();
    // 4.0 is the largest level: the second rise from 3.0 reaches it, and the third stays there.
    assert_eq!(levels, [3.0, 3.0, 2.5, 2.5, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0, 3.5]);
    let turned: Vec<usize> = (1..)
        .zip(&done)
        .filter(|(_, row)| row.reversal)
        .map(|(trial, _)| trial)
        .collect();
    assert_eq!(turned, [5, 10, 11]);
    plan.tests[0].staircase.as_mut().expect("a staircase").stop_after_trials = Some(4);
    assert_eq!(rows(&plan, |index| answers[index]).len(), 4);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the answers, a study that is resumed after any row continues as it would have.
    #[test]
    fn a_resumed_study_has_the_same_rest(answers in prop::collection::vec(any::<bool>(), 64), at in any::<prop::sample::Index>()) {
        let plan = small();
        let whole = rows(&plan, |index| answers[index]);
        let done = at.index(whole.len() + 1);
        let (practice, trials) = whole[..done].split_at(done.min(4));
        let mut session = session(&plan);
        session.resume(practice, trials).expect("its own rows");
        prop_assert_eq!(session.progress().0, done);
        match (session.upcoming(), whole.get(done)) {
            (None, None) => prop_assert_eq!(session.progress().1, Some(done), "nothing is left"),
            (Some(upcoming), Some(row)) => {
                prop_assert_eq!((upcoming.case, upcoming.trial), (row.case, row.trial));
                prop_assert_eq!(upcoming.level_n, row.level_n);
                prop_assert_eq!(upcoming.comparison_first, row.comparison_first);
            }
            (upcoming, row) => prop_assert!(false, "{:?} {:?}", upcoming, row),
        }
    }
}
