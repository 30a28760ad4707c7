use super::super::order::Order;
use super::super::small_plans::fitts_plan;
use super::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Three conditions, two resistances, two trials a segment.
fn small() -> FittsPlan {
    let mut plan = fitts_plan();
    plan.conditions.truncate(3);
    plan.resistances.truncate(2);
    plan.trials_per_segment = 2;
    plan
}

fn session(plan: &FittsPlan) -> FittsSession {
    FittsSession::new(plan, 7, &Subject::numbered(3), Operator::Human, 1e-3)
}

#[test]
fn nine_baseline_segments_precede_all_resistances() {
    let plan = fitts_plan();
    let segments = segments(&plan, 1, &Subject::numbered(1));
    let (practice, counted): (Vec<&Segment>, Vec<&Segment>) = segments.iter().partition(|segment| segment.is_practice);
    assert_eq!((practice.len(), counted.len()), (1, 54));
    assert!(counted[..9].iter().all(|segment| segment.resistance.name == "baseline"));
    let mut counts = BTreeMap::new();
    for segment in &counted[9..] {
        *counts
            .entry((&segment.resistance.name, &segment.condition.name))
            .or_insert(0) += 1;
    }
    assert_eq!(counts.len(), 45);
    for nine in counted.chunks(9) {
        assert!(nine.iter().all(|segment| segment.resistance == nine[0].resistance));
    }
    assert_eq!(counted.iter().filter(|segment| segment.after_rest).count(), 5);
    assert!(counted.iter().map(|segment| segment.block).eq(1..=54));
}

#[test]
fn an_order_is_that_of_seed_and_subject() {
    let plan = fitts_plan();
    let order = |seed, subject| segments(&plan, seed, &Subject::numbered(subject));
    assert_eq!(order(1, 1), order(1, 1));
    assert_ne!(order(1, 1), order(1, 2));
    assert_ne!(order(1, 1), order(2, 1));
    let mut more = plan.clone();
    more.practice_segments = 5;
    assert_eq!(
        segments(&more, 1, &Subject::numbered(1))[5..],
        order(1, 1)[1..],
        "practice changes nothing"
    );
}

#[test]
fn resistances_follow_the_latin_square_or_the_subjects_order() {
    let mut plan = fitts_plan();
    let rounds = |plan: &FittsPlan, subject: &Subject| -> Vec<String> {
        let counted = segments(plan, 1, subject)
            .into_iter()
            .filter(|segment| !segment.is_practice);
        counted
            .skip(9)
            .step_by(9)
            .map(|segment| segment.resistance.name)
            .collect()
    };
    let random = rounds(&plan, &Subject::numbered(2));
    plan.order = Order::LatinSquare;
    let second = ["real", "simulated", "baseline", "viscous", "high stiction"];
    assert_eq!(rounds(&plan, &Subject::numbered(2)), second);
    assert_ne!(random, second);
    let mut own = Subject::numbered(2);
    own.order = ["viscous", "real", "high stiction", "baseline", "simulated"]
        .map(str::to_owned)
        .to_vec();
    assert_eq!(rounds(&plan, &own), own.order);
}

#[test]
fn a_click_is_valid_where_the_whole_cursor_is_inside() {
    let mut session = session(&small());
    session.begin();
    let targets = session.targets().expect("targets");
    let half_m = targets.other_m;
    // The widest place of the cursor's centre, and 0.3 mm beyond it.
    let inside_m = 0.5 * (targets.width_m - targets.cursor_diameter_m);
    let mut click = |tick, task_m: f64| (session.click(tick, task_m / 3.0, 4), session.targets());
    assert_eq!(click(1, half_m).0, Some(Event::Missed));
    assert_eq!(click(10, -half_m + inside_m - 1e-9).0, Some(Event::Started));
    assert_eq!(click(500, half_m + inside_m + 3e-4).0, Some(Event::Missed));
    let (Some(Event::Hit(row)), back) = click(742, half_m - 2e-3) else {
        panic!("inside")
    };
    assert_eq!(
        (row.errors, row.trial, row.direction, row.scene_revision),
        (1, 1, Some(1), Some(4))
    );
    assert!((row.error_size_m.expect("a size") - 3e-4).abs() < 1e-12, "{row:?}");
    assert!(
        (row.movement_time_s - 0.732).abs() < 1e-12 && (row.end_error_m + 2e-3).abs() < 1e-12,
        "{row:?}"
    );
    // The stroke back: an end further to the negative side is overshoot.
    assert_eq!(back.map(|targets| targets.active_m), Some(-half_m));
    assert_eq!(click(742, half_m).0, None, "the same click, reported twice");
    let (Some(Event::Hit(row)), _) = click(1500, -half_m - 1e-3) else {
        panic!("inside")
    };
    assert!(
        (row.end_error_m - 1e-3).abs() < 1e-12 && row.errors == 0 && row.start_tick == Some(742),
        "{row:?}"
    );
    assert_eq!(session.phase(), Phase::Ready);
}

/// What a subject does in a tick.
#[derive(Clone, Copy, Debug)]
enum SubjectAction {
    Begin,
    Pause,
    Hit,
    Miss,
    /// The program ends, and another one continues with the rows.
    Restart,
}

fn actions() -> impl Strategy<Value = Vec<SubjectAction>> {
    let action = prop_oneof![
        4 => Just(SubjectAction::Begin), 1 => Just(SubjectAction::Pause), 8 => Just(SubjectAction::Hit), 2 => Just(SubjectAction::Miss),
        1 => Just(SubjectAction::Restart),
    ];
    prop::collection::vec(action, 0..120)
}

/// The rows of a subject who does this; the practice's and the others'.
fn rows(plan: &FittsPlan, actions: &[SubjectAction]) -> ([Vec<FittsTrial>; 2], usize) {
    let mut session = session(plan);
    let (mut rows, mut misses) = ([Vec::new(), Vec::new()], 0);
    for (tick, action) in (1..).zip(actions) {
        let is_practice = session.segment().is_some_and(|segment| segment.is_practice);
        let target_m = session.targets().map(|targets| targets.active_m);
        let event = match action {
            SubjectAction::Begin => {
                session.begin();
                None
            }
            SubjectAction::Pause => {
                session.pause();
                None
            }
            SubjectAction::Hit => session.click(tick, target_m.unwrap_or_default() / 3.0, 4),
            SubjectAction::Miss => session.click(tick, 0.0, 4),
            SubjectAction::Restart => {
                session = super::tests::session(plan);
                session.resume(&rows[0], &rows[1]).expect("its own rows");
                None
            }
        };
        match event {
            Some(Event::Hit(row)) => rows[usize::from(!is_practice)].push(*row),
            Some(Event::Missed) => misses += usize::from(session.phase() == Phase::Trial),
            _ => {}
        }
    }
    (rows, misses)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever a subject does and however often the program ends, the rows are the plan's in their order, and no
    /// error is counted that was not made.
    #[test]
    fn the_rows_are_those_of_the_plan_whatever_happens(actions in actions()) {
        let plan = small();
        let ([practice, trials], misses) = rows(&plan, &actions);
        let planned = segments(&plan, 7, &Subject::numbered(3));
        let planned = planned.iter().flat_map(|segment| (1..=2).map(move |trial| (segment, trial)));
        let done: Vec<&FittsTrial> = practice.iter().chain(&trials).collect();
        for (row, (segment, trial)) in done.iter().zip(planned) {
            prop_assert_eq!((row.block, row.trial), (segment.block, trial));
            prop_assert_eq!((&row.resistance, &row.condition), (&segment.resistance.name, &segment.condition.name));
            prop_assert!(row.end_error_m.abs() < 1e-12 && row.end_tick > row.start_tick);
        }
        let counted: u32 = done.iter().map(|row| row.errors).sum();
        prop_assert!(counted as usize <= misses);
        // At most the errors of the trials that were broken off are missing.
        if !actions.iter().any(|action| matches!(action, SubjectAction::Pause | SubjectAction::Restart)) {
            let mut session = session(&plan);
            session.resume(&practice, &trials).expect("its own rows");
            prop_assert_eq!(session.progress().0, done.len());
        }
    }
}

#[test]
fn rows_of_another_study_are_not_gone_on_with() {
    let plan = small();
    use SubjectAction::{Begin, Hit};
    let all = [Begin, Hit, Hit, Hit].repeat(20);
    let ([practice, trials], _) = rows(&plan, &all);
    assert_eq!((practice.len(), trials.len()), (2, 18));
    let mut other = FittsSession::new(&plan, 8, &Subject::numbered(3), Operator::Human, 1e-3);
    let error = other.resume(&practice, &trials).expect_err("another order").to_string();
    assert!(
        error.contains("of subject 03: ") && error.contains(", and the plan has "),
        "{error}"
    );
    let mut same = session(&plan);
    same.resume(&practice, &trials).expect("its own rows");
    assert_eq!(same.phase(), Phase::Finished);
    let more = [trials.clone(), trials].concat();
    let error = session(&plan)
        .resume(&practice, &more)
        .expect_err("too many")
        .to_string();
    assert!(error.ends_with("and the plan has no row"), "{error}");
}
