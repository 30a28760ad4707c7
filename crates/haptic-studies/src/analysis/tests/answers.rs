//! What the answers of several subjects say of all people.

use super::*;
use haptic_lab::stats::psychometric::{Resampling, bootstrap};

#[test]
fn answers_of_unlike_subjects_are_no_independent_answers() {
    let width = |interval: [f64; 2]| interval[1] - interval[0];
    let early = [(0.1, 12), (0.2, 16), (0.3, 19), (0.4, 20), (0.5, 20), (0.6, 20)];
    let late = [(0.1, 10), (0.2, 10), (0.3, 11), (0.4, 12), (0.5, 16), (0.6, 19)];
    let trials = [constant("01", &early, 20), constant("02", &late, 20)].concat();
    let found = perception(&trials, None, 1).expect("an analysis");
    let pooled = &found.cases[0].pooled;
    let fit = pooled.fit.expect("a fit");
    let independent = bootstrap(&pooled.levels, &fit, Resampling::Parametric, 100, 1).expect("intervals");
    let independent = independent.threshold_interval;
    let interval = pooled.intervals.expect("intervals").threshold_interval;
    assert!(
        width(interval) > 2.0 * width(independent),
        "{interval:?} {independent:?}"
    );
}

/// A staircase of two subjects that turns at these levels, bottom and top in turn, and its analysis by a plan whose
/// smallest level is 0.5 N.
fn climbed(levels: &[f64], has_plan: bool) -> PerceptionAnalysis {
    let turns: Vec<(f64, bool, bool)> = (0..)
        .zip(levels)
        .map(|(place, level)| (*level, place % 2 == 1, true))
        .collect();
    let trials = ["01", "02"].map(|subject| answers(subject, Case::B, Method::Staircase, &turns));
    let mut plan = perception_plan();
    let test = plan.tests.iter_mut().find_map(|test| test.staircase.as_mut());
    let range = test.expect("a staircase");
    (range.smallest_n, range.largest_n) = (0.5, 1.5);
    perception(&trials.concat(), has_plan.then_some(&plan), 1).expect("an analysis")
}

#[test]
fn a_staircase_at_an_end_of_its_range_has_no_threshold() {
    for (levels, why) in [
        (
            [0.5, 0.6],
            "6 of the 6 reversals at the bottom are at smallest_N = 0.5 N, where the staircase could not go on: test \
             smaller levels",
        ),
        (
            [1.4, 1.5],
            "6 of the 6 reversals at the top are at largest_N = 1.5 N, where the staircase could not go on: test \
             larger levels",
        ),
    ] {
        let found = climbed(&levels.repeat(8), false);
        assert!(found.cases[0].staircase_n.is_some());
        let is_without_plan = |found: &PerceptionAnalysis| {
            let mut notes = found.notes.iter();
            notes.any(|note| note.starts_with("without the plan"))
        };
        assert!(is_without_plan(&found), "{:?}", found.notes);
        let found = climbed(&levels.repeat(8), true);
        assert!(found.cases[0].staircase_n.is_none() && !is_without_plan(&found));
        assert_eq!(found.cases[0].subjects.len(), 2);
        for one in &found.cases[0].subjects {
            let code = one.subject.as_ref().expect("a subject");
            let refused = super::why(&found.refused, &format!("staircase of subject {code}, case B"));
            assert_eq!(refused, why);
            assert_eq!(one.staircase_refused.as_ref().map(ToString::to_string), Some(refused));
        }
    }
    // Once is no end, and subjects who are alike say nothing of others.
    let once = climbed(&[[0.6, 0.8].repeat(5), vec![0.5, 0.8, 0.6, 0.8]].concat(), true);
    let mean = once.cases[0].staircase_n.expect("a staircase");
    assert!((mean.value - 0.69).abs() < 1e-9 && mean.interval.is_none(), "{mean:?}");
}

#[test]
fn a_note_says_where_two_means_are_of_other_subjects() {
    let notes = |found: &PerceptionAnalysis| crate::analysis::tables::footnotes(found, "jnd");
    let mut found = climbed(&[0.6, 0.8].repeat(8), true);
    found.cases[0].jnd_n = found.cases[0].staircase_n;
    assert!(notes(&found).is_empty());
    let alone = found.cases[0].jnd_n.as_mut().expect("a staircase");
    alone.count = 1;
    assert_eq!(
        notes(&found),
        [
            "B staircase: the mean is of 1 of 2 subjects, as the thresholds of the others are not determined, which \
             biases it towards the tested levels",
            "case B: the JND is the mean of 1 of the subjects, that of the staircases of 2",
        ]
    );
}

#[test]
fn reason_and_advice_are_two_fields_and_one_text() {
    for (correct, reason, advice, text) in [
        (
            true,
            "all 3 answers are correct: the threshold is below every level",
            "test smaller differences",
            "all 3 answers are correct: the threshold is below every level; test smaller differences",
        ),
        (
            false,
            "all 3 answers are wrong, where guessing gets half of them right",
            "check which answer counts as correct",
            "all 3 answers are wrong, where guessing gets half of them right: check which answer counts as correct",
        ),
    ] {
        let same = [0.1, 0.2, 0.3].map(|level| (level, correct, false));
        let found = perception(&answers("01", Case::A, Method::Constant, &same), None, 1).expect("an analysis");
        let json = serde_json::to_value(&found).expect("JSON");
        for why in [&json["refused"][0], &json["cases"][0]["pooled"]["refused"]] {
            assert_eq!(
                (&why["reason"], &why["advice"]),
                (&reason.into(), &advice.into()),
                "{json}"
            );
        }
        let files = perception_files(&found, &SubjectTable::default(), "Cases");
        for (name, is_whole) in [("jnd.csv", true), ("psychometric.svg", true), ("jnd.tex", false)] {
            // A figure breaks its lines.
            let file = text_of(&files, name);
            let has = |text: &str| text.split(' ').all(|word| file.contains(word));
            assert!(has(reason) && has(text) == is_whole, "{name}: {file}");
        }
    }
}
