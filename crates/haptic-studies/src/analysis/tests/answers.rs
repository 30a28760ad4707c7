//! What the answers of several subjects say of all people.

use super::*;
use haptic_lab::stats::psychometric::{Resampling, bootstrap};

/// The answers of each subject: levels, how many of 20 are correct at each.
fn of_subjects(subjects: &[[usize; 6]]) -> Vec<PerceptionTrial> {
    let own = |(number, correct): (usize, &[usize; 6])| {
        let levels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6].into_iter().zip(*correct);
        let own: Vec<(f64, bool, bool)> = levels
            .flat_map(|(level, correct)| (0..20).map(move |place| (level, place < correct, false)))
            .collect();
        let mut own = answers(Case::A, Method::Constant, &own);
        own.iter_mut().for_each(|trial| trial.subject = format!("{number:02}"));
        own
    };
    subjects.iter().enumerate().flat_map(own).collect()
}

#[test]
fn answers_of_unlike_subjects_are_no_independent_answers() {
    let width = |interval: [f64; 2]| interval[1] - interval[0];
    let early = [12, 16, 19, 20, 20, 20];
    let late = [10, 10, 11, 12, 16, 19];
    let found = perception(&of_subjects(&[early, late, early, late]), 1).expect("an analysis");
    let pooled = &found.cases[0].pooled;
    let fit = pooled.fit.expect("a fit");
    let independent = bootstrap(&pooled.levels, &fit, Resampling::Parametric, 100, 1).threshold_interval;
    let interval = pooled.intervals.expect("intervals").threshold_interval;
    assert!(
        width(interval) > 2.0 * width(independent),
        "{interval:?} {independent:?}"
    );
}
