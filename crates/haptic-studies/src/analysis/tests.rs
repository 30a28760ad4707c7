//! Analyses of studies that can be worked out by hand.

mod answers;
mod files;

use super::*;
use crate::small_plans::{fitts_plan, perception_plan};
use crate::subject_table::SubjectTable;
use crate::trial::{self, Case, Method, PerceptionTrial};
use serde_json::Value;

/// A segment of two movements that end 10 mm beyond and 10 mm before the target's centre. All errors of the segment
/// were made in its first trial; `error_size_m` is their sum.
fn segment(
    (subject, block, resistance, condition): (&str, u32, &str, &str),
    times_s: [f64; 2],
    (errors, error_size_m): (u32, f64),
) -> Vec<FittsTrial> {
    // Room for the cursor of 40 mm: 80 and 20 mm, so that the indices are log2(640 / 80) = 3 and log2(640 / 20) = 5.
    let width_m = if condition == "easy" { 0.12 } else { 0.06 };
    (1..)
        .zip(times_s)
        .map(|(trial, movement_time_s)| FittsTrial {
            subject: subject.to_owned(),
            session: 1,
            block,
            resistance: resistance.to_owned(),
            condition: condition.to_owned(),
            trial,
            amplitude_m: 0.32,
            width_m,
            cursor_diameter_m: Some(0.04),
            end_error_m: if trial == 1 { 0.01 } else { -0.01 },
            movement_time_s,
            errors: if trial == 1 { errors } else { 0 },
            error_size_m: Some(if trial == 1 { error_size_m } else { 0.0 }),
            ..FittsTrial::default()
        })
        .collect()
}

/// Two subjects, two conditions, two resistances and the baseline.
fn study() -> Vec<FittsTrial> {
    [
        // An early round of the baseline, which does not count.
        segment(("a", 1, "baseline", "easy"), [4.0, 5.0], (7, 0.07)),
        // a, easy: 2.0 s, 1 error of 4 mm.
        segment(("a", 3, "baseline", "easy"), [1.0, 1.0], (1, 0.004)),
        // -0.5 s is the threshold: better. -1 error: better. -4 mm: better.
        segment(("a", 4, "real", "easy"), [0.7, 0.8], (0, 0.0)),
        // +0.6 s: worse. +1 error: worse. 5 mm in the mean, +1 mm: worse.
        segment(("a", 5, "viscous", "easy"), [1.3, 1.3], (2, 0.010)),
        // a, hard: 3.0 s, no error.
        segment(("a", 6, "baseline", "hard"), [1.5, 1.5], (0, 0.0)),
        // +0.4 s: same. +1 error: worse. +0.5 mm: same.
        segment(("a", 7, "real", "hard"), [1.6, 1.8], (1, 0.0005)),
        // -0.6 s: better. No error more: same. Same.
        segment(("a", 8, "viscous", "hard"), [1.0, 1.4], (0, 0.0)),
        // b, easy: 2.2 s, no error.
        segment(("b", 1, "baseline", "easy"), [1.1, 1.1], (0, 0.0)),
        // -0.6 s: better. Same. Same.
        segment(("b", 2, "real", "easy"), [0.8, 0.8], (0, 0.0)),
        // +0.1 s: same. Same. Same.
        segment(("b", 3, "viscous", "easy"), [1.1, 1.2], (0, 0.0)),
        // b, hard: 4.0 s, 2 errors of 3 mm in the mean.
        segment(("b", 4, "baseline", "hard"), [2.0, 2.0], (2, 0.006)),
        // -0.6 s: better. -1 error: better. 1 mm, -2 mm: better.
        segment(("b", 5, "real", "hard"), [1.7, 1.7], (1, 0.001)),
        // +0.7 s: worse. +1 error: worse. 4 mm in the mean, +1 mm: worse.
        segment(("b", 6, "viscous", "hard"), [2.3, 2.4], (3, 0.012)),
    ]
    .concat()
}

fn analysed(trials: &[FittsTrial]) -> FittsAnalysis {
    fitts(trials, BASELINE, &Thresholds::PAPER, Task::Serial).expect("an analysis")
}

/// The files of an analysis.
fn files_of(found: &FittsAnalysis) -> Vec<(String, Vec<u8>)> {
    fitts_files(found, &[], &SubjectTable::default(), "A study")
}

/// The text of a file.
fn text_of<'a>(files: &'a [(String, Vec<u8>)], name: &str) -> &'a str {
    let (_, bytes) = files.iter().find(|(found, _)| found == name).expect(name);
    std::str::from_utf8(bytes).expect("text")
}

/// Why something was refused.
#[track_caller]
fn why(refused: &[Refusal], what: &str) -> String {
    let found = refused.iter().find(|one| one.what == what);
    found.unwrap_or_else(|| panic!("{what}: {refused:?}")).why.to_string()
}

#[test]
fn every_cell_of_a_small_study_matches_hand_derivation() {
    let found = analysed(&study());
    let cells = |comparison: &Comparison| -> Vec<[[u64; 2]; 2]> {
        let of = |row: &ComparisonRow| [0, 1].map(|place: usize| [row.counts[place].better, row.counts[place].worse]);
        comparison.rows.iter().map(of).collect()
    };
    // Rows: easy (3 bit), hard (5 bit); in each real, viscous; in each better, worse.
    for (comparison, measure, rows) in [
        (0, Measure::Time, [[[2, 0], [0, 1]], [[1, 0], [1, 1]]]),
        (1, Measure::Errors, [[[1, 0], [0, 1]], [[1, 1], [0, 1]]]),
        (2, Measure::ErrorSize, [[[1, 0], [0, 1]], [[1, 0], [0, 1]]]),
    ] {
        let comparison = &found.comparisons[comparison];
        assert_eq!((comparison.measure, cells(comparison)), (measure, rows.to_vec()));
        assert_eq!(comparison.resistances, ["real", "viscous"]);
        let indices: Vec<f64> = comparison.rows.iter().map(|row| row.difficulty_bit).collect();
        assert!(
            (indices[0] - 3.0).abs() < 1e-12 && (indices[1] - 5.0).abs() < 1e-12,
            "{indices:?}"
        );
    }
    let totals = |comparison: usize, place: usize| {
        let of = &found.comparisons[comparison].totals[place];
        [of.better, of.worse, of.same, of.subjects_better, of.subjects_worse]
    };
    // Time. real: a better and same, b twice better. viscous: a worse and better, which is even; b same and worse.
    assert_eq!((totals(0, 0), totals(0, 1)), ([3, 0, 1, 2, 0], [1, 2, 1, 0, 1]));
    // Errors. real: a better and worse, even; b same and better. viscous: a worse and same, b same and worse.
    assert_eq!((totals(1, 0), totals(1, 1)), ([2, 1, 1, 1, 0], [0, 2, 2, 0, 2]));
    // Size. real: a better and same, b same and better. viscous: a worse and same, b same and worse.
    assert_eq!((totals(2, 0), totals(2, 1)), ([2, 0, 2, 2, 0], [0, 2, 2, 0, 2]));
    // 2 of 2: 2 / 2^2. 1 of 1: 2 / 2, which is certain.
    let times = &found.comparisons[0];
    assert!((times.totals[0].sign_test_p - 0.5).abs() < 1e-12 && (times.totals[1].sign_test_p - 1.0).abs() < 1e-12);
    // Both did better with real than with viscous: a by -1 - 1 + 0 + 1 = -1, b by -1 - 0 - 1 - 1 = -3.
    let pair = &times.pairs[0];
    assert_eq!((pair.first.as_str(), pair.second.as_str()), ("real", "viscous"));
    assert_eq!((pair.subjects_first, pair.subjects_second), (2, 0));
    assert!((pair.sign_test_p - 0.5).abs() < 1e-12);
}

#[test]
fn a_baseline_of_another_name_is_what_others_are_compared_with() {
    let mut trials = study();
    for trial in trials.iter_mut().filter(|trial| trial.resistance == BASELINE) {
        trial.resistance = "free".to_owned();
    }
    let of = |baseline: &str| fitts(&trials, baseline, &Thresholds::PAPER, Task::Serial).expect("an analysis");
    let (found, expected) = (of("free"), analysed(&study()));
    assert_eq!(found.comparisons, expected.comparisons);
    assert_eq!(found.by_resistance[0].resistance.as_deref(), Some("free"));
    assert!(of(BASELINE).comparisons.is_empty());
}

#[test]
fn the_papers_values_stand_beside_the_papers_study_alone() {
    let mut found = analysed(&study());
    assert!(found.beside_paper.is_empty(), "the rows alone do not say what was felt");
    found.put_beside_paper(&fitts_plan());
    let real = &found.beside_paper[0];
    assert_eq!((real.paper, real.study), ([74, 50], [3, 0]));
    // Of 77 better and 50 worse, 3 are drawn in C(127,3) = 333375 ways; as unlikely as 3 better (73150) or less likely
    // are only 3 worse (19600).
    assert!((real.fisher_p - 92_750.0 / 333_375.0).abs() < 1e-9, "{real:?}");
    let mut beside = |change: &dyn Fn(&mut FittsPlan)| {
        let mut plan = fitts_plan();
        change(&mut plan);
        found.put_beside_paper(&plan);
        let names = found.beside_paper.iter().map(|one| one.resistance.clone());
        names.collect::<Vec<_>>()
    };
    assert_eq!(beside(&|_| {}), ["real", "viscous"]);
    assert_eq!(beside(&|plan| plan.rest_s = 30.0), ["real", "viscous"]);
    let felt = |plan: &mut FittsPlan, from: &str, to: &str| {
        let names = plan.resistances.iter().map(|one| one.name.as_str());
        let [from, to] = [from, to].map(|name| names.clone().position(|one| one == name).expect("a resistance"));
        plan.resistances[to].mounted = None;
        plan.resistances[to].scene = plan.resistances[from].scene.clone();
    };
    assert_eq!(beside(&|plan| felt(plan, "simulated", "viscous")), ["real"]);
    assert!(beside(&|plan| felt(plan, "simulated", "baseline")).is_empty());
    assert!(beside(&|plan| plan.conditions[0].width_m *= 2.0).is_empty());

    let mut plan = perception_plan();
    let mut found = twice(&[(0.1, 11), (0.2, 12), (0.3, 14), (0.4, 16), (0.5, 18), (0.6, 19)]);
    let has_paper = |found: &PerceptionAnalysis| {
        let data = perception_data(found, &SubjectTable::default());
        [perception_tables(found), data].map(|tables| {
            let (_, table) = tables.iter().find(|(name, _)| name == "jnd").expect("a table");
            table.rows[0].iter().any(|name| name.contains("paper"))
        })
    };
    assert_eq!(has_paper(&found), [false; 2]);
    found.put_beside_paper(&plan);
    assert_eq!((found.cases[0].paper_jnd_n, has_paper(&found)), (Some(0.78), [true; 2]));
    plan.base.friction = fitts_plan().resistances[4].rendered().friction;
    found.put_beside_paper(&plan);
    assert_eq!((found.cases[0].paper_jnd_n, has_paper(&found)), (None, [false; 2]));
}

#[test]
fn throughput_is_the_mean_over_sequences() {
    let found = analysed(&study());
    // dx 10 and -10 mm: Ae = 320 + (10 - 10 + 0 + 10) / 2 = 325 mm; SDx = sqrt(200) = 14.142 mm; We = 58.446 mm;
    // IDe = log2(325 / 58.446 + 1) = 2.713859 bit in every sequence.
    let first = &found.sequences[0];
    let of = &first.throughput;
    assert!((of.effective_amplitude_m - 0.325).abs() < 1e-12, "{first:?}");
    assert!((of.effective_width_m - 0.058_445_647).abs() < 1e-8, "{first:?}");
    assert!((of.effective_id_bit - 2.713_86).abs() < 1e-4, "{first:?}");
    // real took 0.75, 1.7, 0.8 and 1.7 s: the mean of the inverses is 0.939951 / s.
    let real = &found.by_resistance[1];
    assert_eq!(
        (real.resistance.as_deref(), real.sequence_count, real.subject_count),
        (Some("real"), 4, 2)
    );
    assert!(
        (real.throughput_bit_per_s / of.effective_id_bit - 0.939_951).abs() < 1e-6,
        "{real:?}"
    );
    assert!(real.throughput_interval_bit_per_s.is_some());
    let overall = found.overall.as_ref().expect("sequences");
    assert_eq!(overall.sequence_count, 13);
    // Of the two movements of a sequence, one has invalid clicks in 7 of 13. An end beside the target is an error too.
    assert!((overall.error_rate - 7.0 / 26.0).abs() < 1e-12, "{overall:?}");
    let mut trials = study();
    trials[0].end_error_m = 0.061;
    trials[1].end_error_m = -0.061;
    assert!((analysed(&trials).sequences[0].error_rate - 1.0).abs() < 1e-12);
}

#[test]
fn fittss_line_goes_through_the_means_of_the_conditions() {
    // A third condition: room 80 mm at 160 mm, 2 bit. Movements of 0.4, 0.6 and 1.0 s at 2, 3 and 5 bit: 0.2 s a bit.
    let mut trials = [
        segment(("a", 1, "real", "easy"), [0.5, 0.7], (0, 0.0)),
        segment(("a", 2, "real", "hard"), [0.9, 1.1], (0, 0.0)),
        segment(("a", 3, "real", "easy"), [0.3, 0.5], (0, 0.0)),
    ]
    .concat();
    for trial in &mut trials[4..] {
        trial.condition = "short".to_owned();
        trial.amplitude_m = 0.16;
    }
    let found = analysed(&trials);
    let line = found.difficulty[0].line.expect("three conditions");
    assert!(
        (line.slope - 0.2).abs() < 1e-9 && line.intercept.abs() < 1e-9,
        "{line:?}"
    );
    why(&found.refused, "comparison with the baseline");
    // Two conditions determine no line with an interval.
    let refused = why(&analysed(&study()).refused, "regression of real");
    assert!(refused.contains("2; at least 3"), "{refused}");
}

#[test]
fn the_order_of_the_rows_does_not_matter() {
    let mut trials = study();
    let json = |trials: &[FittsTrial]| serde_json::to_string(&analysed(trials)).expect("JSON");
    let ordered = json(&trials);
    fastrand::Rng::with_seed(1).shuffle(&mut trials);
    assert_eq!(json(&trials), ordered);
    let value: Value = serde_json::from_str(&ordered).expect("JSON");
    for value in [&value, &value["by_resistance"][0]] {
        for name in ["effective_width_m", "effective_amplitude_m", "effective_id_bit"] {
            assert!(value[name].is_f64() && value["throughput_bit_per_s"].is_f64(), "{name}");
        }
    }
}

#[test]
fn rows_that_contradict_one_another_are_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Vec<FittsTrial>)| {
        let mut trials = study();
        change(&mut trials);
        fitts(&trials, BASELINE, &Thresholds::PAPER, Task::Serial)
            .expect_err("refused")
            .to_string()
    };
    assert_eq!(refused(&|trials| trials.clear()), "there are no trials");
    assert_eq!(
        refused(&|trials| trials[1].trial = 1),
        "trial 1 of subject a, block 1, resistance baseline, condition easy is there twice"
    );
    assert_eq!(
        refused(&|trials| trials[1].amplitude_m = 0.4),
        "trial 2 of subject a, block 1, resistance baseline, condition easy has amplitude_m = 0.4 m, the trials before \
         it 0.32 m"
    );
    assert_eq!(
        refused(&|trials| trials[2..4].iter_mut().for_each(|trial| trial.width_m = 0.1)),
        "condition `easy` has width_m = 0.1 m in subject a, block 3, resistance baseline, condition easy, and 0.12 m \
         elsewhere"
    );
    assert!(
        refused(&|trials| trials[0].operator = Some(Operator::Simulated)).contains("more than one kind of operator")
    );
}

#[test]
fn what_a_segment_cannot_tell_is_refused_and_the_rest_stands() {
    let mut trials = study();
    // One trial of a's easy segment under the real friction is missing.
    trials.remove(5);
    let found = analysed(&trials);
    for (what, reason) in [
        ("throughput", "movements: 1; at least 2 are needed"),
        ("comparison", "it has 1 trials, and the baseline (block 3) has 2"),
    ] {
        let name = format!("{what} of subject a, block 4, resistance real, condition easy");
        assert_eq!(why(&found.refused, &name), reason);
    }
    assert_eq!(found.comparisons[0].rows[0].counts[0].better, 1);
    // Without sizes there is no Table 5.
    trials.iter_mut().for_each(|trial| trial.error_size_m = None);
    let measures: Vec<Measure> = analysed(&trials).comparisons.iter().map(|one| one.measure).collect();
    assert_eq!(measures[..2], [Measure::Time, Measure::Errors]);
}

/// A subject's answers: the level, whether it is correct, and whether the staircase turned.
fn answers(subject: &str, case: Case, method: Method, answers: &[(f64, bool, bool)]) -> Vec<PerceptionTrial> {
    let heading = "subject,case,method,trial,base_static_N,base_dynamic_N,comparison_static_N,comparison_dynamic_N,level_N,\
                   comparison_first,answer,correct,reversal";
    let rows = (1..).zip(answers).map(|(trial, (level_n, correct, reversal))| {
        let (fs, fd, answer) = (4.0 + level_n, 3.5 + level_n, if *correct { 1 } else { 2 });
        let method = method.name();
        format!("{subject},{case:?},{method},{trial},4,3.5,{fs},{fd},{level_n},true,{answer},{correct},{reversal}\n")
    });
    trial::read(format!("{heading}\n{}", rows.collect::<String>()).as_bytes()).expect("trials")
}

/// A subject's answers to constant stimuli: of `each` at every level, so many are correct.
fn constant(subject: &str, levels: &[(f64, usize)], each: usize) -> Vec<PerceptionTrial> {
    let at_level = |&(level, correct)| (0..each).map(move |place| (level, place < correct, false));
    let own: Vec<(f64, bool, bool)> = levels.iter().flat_map(at_level).collect();
    answers(subject, Case::A, Method::Constant, &own)
}

#[test]
fn a_case_has_its_threshold_and_a_staircase_its_reversals() {
    let levels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8].into_iter();
    let levels: Vec<(f64, usize)> = levels.zip([21, 24, 27, 32, 35, 37, 39]).collect();
    // Reversals at 3.0 2.0 2.6 2.2 | 2.8 2.4 2.6 2.2: the first four do not count, and the mean of the rest is 2.5.
    let staircase: Vec<(f64, bool, bool)> = [3.0, 2.0, 2.6, 2.2, 2.8, 2.4, 2.6, 2.2]
        .into_iter()
        .enumerate()
        .map(|(place, level)| (level, place % 2 == 0, true))
        .collect();
    let mut trials = [
        constant("01", &levels, 40),
        answers("01", Case::B, Method::Staircase, &staircase),
    ]
    .concat();
    let found = perception(&trials, None, 1).expect("an analysis");
    let [a, b] = &found.cases[..] else { panic!("two cases") };
    let threshold = a.jnd_n.expect("a threshold").value;
    assert!((threshold - 0.3548).abs() < 1e-4, "{threshold}");
    let intervals = a.subjects[0].intervals.expect("intervals").threshold_interval;
    assert!(intervals[0] < threshold && threshold < intervals[1], "{intervals:?}");
    assert_eq!(a.pooled.fit, a.subjects[0].fit);
    assert!((b.staircase_n.expect("reversals").value - 2.5).abs() < 1e-12);
    // Its answers do not get better with the level.
    assert_eq!(b.jnd_n, None);
    why(&found.refused, "threshold of subject 01, case B");
    let files = perception_files(&found, &SubjectTable::default(), "Cases");
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "analysis.html",
            "psychometric.svg",
            "jnd.md",
            "jnd.tex",
            "subjects.md",
            "subjects.tex",
            "jnd.csv",
            "subjects.csv",
            "psychometric.csv"
        ]
    );
    let picture = text_of(&files, "psychometric.svg");
    assert!(picture.starts_with("<svg") && picture.contains("Case A"));
    assert!(
        picture.contains("area: 1 to 2 answers") && picture.contains("Not fitted: "),
        "{picture}"
    );
    let page = text_of(&files, "analysis.html");
    assert!(page.contains("threshold 0.355 N") && page.contains("Case B"));
    fastrand::Rng::with_seed(1).shuffle(&mut trials);
    assert_eq!(perception(&trials, None, 1).expect("an analysis"), found);
    trials.push(trials[0].clone());
    let error = perception(&trials, None, 1).expect_err("twice").to_string();
    assert!(error.contains("is there twice"), "{error}");
}

/// Two subjects with the same answers: of 20 at each level, so many are correct.
fn twice(levels: &[(f64, usize)]) -> PerceptionAnalysis {
    let trials = ["01", "02"].map(|subject| constant(subject, levels, 20));
    perception(&trials.concat(), None, 1).expect("an analysis")
}

#[test]
fn a_mean_is_no_surer_than_its_subjects() {
    // One is as good as the other, and yet neither is known that well.
    let found = twice(&[(0.1, 11), (0.2, 12), (0.3, 14), (0.4, 16), (0.5, 18), (0.6, 19)]);
    let case = &found.cases[0];
    let width = |interval: [f64; 2]| interval[1] - interval[0];
    let own = case.subjects[0].intervals.expect("an interval").threshold_interval;
    let mean = case.jnd_n.and_then(|mean| mean.interval).expect("an interval");
    assert!(
        own[1] > own[0] && width(mean) >= 0.999 * width(own) / 2.0_f64.sqrt(),
        "{mean:?} {own:?}"
    );
}

#[test]
fn answers_that_jump_have_no_interval() {
    // Chance below 0.3 N, certain above.
    for (at_jump, precision_n) in [(15, 1e-3), (13, 5e-3)] {
        let found = twice(&[(0.1, 10), (0.2, 10), (0.3, at_jump), (0.4, 20), (0.5, 20)]);
        let case = &found.cases[0];
        let mut subjects = case.subjects.iter();
        assert!(
            subjects.all(|one| one.fit.is_some() && one.intervals.is_none()),
            "{case:?}"
        );
        let mean = case.jnd_n.expect("two thresholds");
        assert!(
            (mean.value - 0.3).abs() < precision_n && mean.interval.is_none(),
            "{mean:?}"
        );
        // Named as it was tested.
        let jump = "all subjects together, case A: the answers jump at the level of 0.3 N: ";
        assert!(found.notes.iter().any(|note| note.starts_with(jump)), "{found:?}");
        assert!(
            found.notes.iter().any(|note| note.ends_with("it has no interval")),
            "{found:?}"
        );
    }
}
