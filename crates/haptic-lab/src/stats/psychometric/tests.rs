use super::*;
use fastrand::Rng;
use proptest::prelude::*;

/// Seven levels with 40 trials each.
fn worked() -> Vec<Level> {
    let levels = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8];
    answered(40, levels.into_iter().zip([21, 24, 27, 32, 35, 37, 39]))
}

/// An observer with few lapses.
fn observer(threshold: f64, width: f64) -> Psychometric {
    Psychometric {
        threshold,
        width,
        lapse: 0.02,
        deviance: 0.0,
    }
}

/// What an observer answers, so many times at each level.
fn drawn(of: &Psychometric, trials: u32, levels: impl IntoIterator<Item = f64>, random: &mut Rng) -> Vec<Level> {
    let mut correct = |level| {
        (0..trials)
            .map(|_| u32::from(random.f64() < of.probability(level)))
            .sum()
    };
    answered(trials, levels.into_iter().map(|level| (level, correct(level))))
}

#[test]
fn the_likelihood_is_largest_where_a_search_by_hand_finds_it() {
    // A search over a grid of lapses (0.001 apart) with a pattern search in the others gives 0.35477, 0.60830, 0.023.
    let found = fit(&worked()).expect("a fit");
    assert!((found.threshold - 0.3548).abs() < 1e-4, "{found:?}");
    assert!((found.width - 0.608).abs() < 1e-3, "{found:?}");
    assert!((found.lapse - 0.023).abs() < 1e-3, "{found:?}");
    // Half way up between guessing and the ceiling.
    let middle = found.probability(found.threshold);
    assert!((middle - (0.5 + 0.5 * (0.5 - found.lapse))).abs() < 1e-12);
}

#[test]
fn the_interval_holds_what_psignifit_finds() {
    // psignifit 4.3 gives the threshold 0.3602 with the 95 % interval 0.236 to 0.427, under its priors.
    let found = fit(&worked()).expect("a fit");
    for resampling in [Resampling::Parametric, Resampling::Nonparametric] {
        let interval = bootstrap(&worked(), &found, resampling, 200, 1).expect("intervals");
        let [low, high] = interval.threshold_interval;
        assert!(low < 0.3548 && 0.3602 < high, "{interval:?}");
        assert!(
            (low - 0.236).abs() < 0.06 && (high - 0.427).abs() < 0.04,
            "{interval:?}"
        );
        assert_eq!(Some(interval), bootstrap(&worked(), &found, resampling, 200, 1));
        assert_ne!(Some(interval), bootstrap(&worked(), &found, resampling, 200, 2));
    }
    // The data lie nearer to a smooth function than chance would have them.
    let intervals = bootstrap(&worked(), &found, Resampling::Parametric, 200, 1).expect("intervals");
    assert!(intervals.worse_fits > 0.3);
}

/// Levels that are twice as large each, and a function that rises between two of them: drawn answers often jump.
#[test]
fn the_interval_of_far_levels_holds_truth_and_fit() {
    let levels = [0.2, 0.4, 0.8, 1.6];
    let mut random = Rng::with_seed(5);
    let (mut all, mut held) = (0, 0);
    for (threshold, width) in [(0.5, 0.5), (1.0, 0.8)] {
        let truth = observer(threshold, width);
        for set in 0..40 {
            let answers = drawn(&truth, 20, levels, &mut random);
            let Ok(found) = fit(&answers) else { continue };
            let Some(intervals) = bootstrap(&answers, &found, Resampling::Parametric, 40, set) else {
                continue;
            };
            let [low, high] = intervals.threshold_interval;
            assert!(
                low <= found.threshold && found.threshold <= high,
                "{found:?} {intervals:?}"
            );
            all += 1;
            held += u32::from(low <= threshold && threshold <= high);
        }
    }
    // From percentiles alone, half of them do.
    assert!(all >= 25 && 10 * held >= 9 * all, "{held} of {all}");
}

#[test]
fn a_level_without_answers_changes_no_interval() {
    let mut levels = worked();
    let found = fit(&levels).expect("a fit");
    let without = bootstrap(&levels, &found, Resampling::Parametric, 40, 1);
    levels.splice(1..1, answered(0, [(0.15, 0)]));
    assert_eq!(bootstrap(&levels, &found, Resampling::Parametric, 40, 1), without);
    assert!(without.is_some());
}

#[test]
fn an_interval_without_an_end_is_none() {
    let answers = answered(10, [(0.2, 5), (0.4, 6), (0.8, 7), (1.6, 8)]);
    let found = fit(&answers).expect("a fit");
    assert_eq!(bootstrap(&answers, &found, Resampling::Parametric, 40, 1), None);
}

/// 2000 answers at each of 16 levels.
fn answers_of(truth: &Psychometric, unit: f64, seed: u64) -> Vec<Level> {
    let levels = (0..16).map(|place| f64::from(place) / 10.0);
    let mut answers = drawn(truth, 2000, levels, &mut Rng::with_seed(seed));
    answers.iter_mut().for_each(|one| one.level *= unit);
    answers
}

#[test]
fn a_level_with_exactly_half_correct_does_not_end_the_search() {
    // The search begins where the function is at a half there but for its last digits.
    let truth = observer(0.488_458_554_154_208_1, 0.3);
    let levels = answers_of(&truth, 1.0, 691);
    assert_eq!(levels[1].correct, 1000);
    let found = fit(&levels).expect("a fit");
    assert!(
        found.deviance < 30.0 && (found.threshold - truth.threshold).abs() < 0.01,
        "{found:?}"
    );
}

#[test]
fn what_has_no_threshold_is_refused_by_name() {
    let refused = |correct: &[u32]| {
        let levels = answered(20, (1..).map(f64::from).zip(correct.iter().copied()));
        let error = fit(&levels).expect_err("refused");
        let advice = error.advice().map_or_else(String::new, |advice| format!("; {advice}"));
        error.to_string() + &advice
    };
    assert_eq!(refused(&[12, 18]), "levels: 2; at least 3 are needed");
    assert!(refused(&[20, 20, 20]).starts_with("all 60 answers are correct"));
    assert!(refused(&[0, 0, 0]).starts_with("all 60 answers are wrong"));
    assert!(refused(&[18, 15, 12]).starts_with("answers do not get better"));
    assert!(refused(&[14, 14, 14]).starts_with("answers do not get better"));
    assert!(refused(&[15, 20, 20, 16, 17, 16]).starts_with("answers do not get better"));
    // Nobody answered on the one side of an outermost level at which they jump.
    let lowest = "the threshold is at the lowest tested level, 1, or below it; test lower levels";
    let highest = "the threshold is at the highest tested level, 3, or above it; test higher levels";
    for (correct, reason) in [
        ([19, 20, 20], lowest),
        ([15, 20, 20], lowest),
        ([10, 10, 11], highest),
        ([10, 10, 15], highest),
    ] {
        assert_eq!(refused(&correct), reason);
    }
    let jump = |below, above| {
        format!(
            "answers jump from about chance to the ceiling between the tested levels {below} and {above}; test levels between them"
        )
    };
    assert_eq!(refused(&[10, 10, 20, 20]), jump(2, 3));
    assert_eq!(refused(&[12, 20, 18, 20]), jump(1, 2));
    assert_eq!(refused(&[10, 10, 18]), jump(2, 3));
    assert_eq!(refused(&[10, 25, 20]), "25 of 20 answers are correct at level 2");
}

/// Answers to levels in newtons, of so many at each.
fn answered(trials: u32, correct: impl IntoIterator<Item = (f64, u32)>) -> Vec<Level> {
    let of = |(level, correct)| Level { level, trials, correct };
    correct.into_iter().map(of).collect()
}

#[test]
fn answers_are_joined_by_level() {
    let joined = by_level([(0.2, true), (0.1, false), (0.2, false), (0.1, false), (0.2, true)]);
    let expected = [(0.1, 2, 0), (0.2, 3, 2)].map(|(level, trials, correct)| Level { level, trials, correct });
    assert_eq!(joined, expected);
}

/// Of random answers, good and bad, no function of a fine grid is likelier than the one that is found.
#[test]
fn no_function_of_a_fine_grid_is_likelier() {
    let mut random = Rng::with_seed(37);
    let sets = test_run::extent(60, 2000);
    for set in 0..sets {
        let levels: Vec<Level> = (0..random.usize(3..9))
            .scan(0.0, |level, _| {
                *level += [0.05, 0.1, 0.1, 0.4][random.usize(0..4)];
                let trials = random.u32(1..60);
                // Some observers only guess, some learn backwards, some are at the ceiling from the first level on.
                let share = (0.5 + 0.5 * (*level * random.f64())).min(1.0 - 0.1 * random.f64());
                let correct = (0..trials).map(|_| u32::from(random.f64() < share)).sum();
                let level = *level;
                Some(Level { level, trials, correct })
            })
            .collect();
        let found = best(&levels, None);
        let (low, high) = (levels[0].level, levels[levels.len() - 1].level);
        let extent = high - low;
        for width in (0..60).map(|step| extent * 1e-3 * 10_f64.powf(f64::from(step) / 12.0)) {
            let even = (-50..=150).map(|step| low + extent * f64::from(step) / 100.0);
            let near = levels
                .iter()
                .flat_map(|level| (-8..=8).map(|step| level.level + 0.1 * f64::from(step) * width));
            for threshold in even.chain(near) {
                for lapse in [0.0, 0.01, 0.02, 0.04, 0.06, 0.08, MAX_LAPSE] {
                    let function = Psychometric {
                        lapse,
                        ..observer(threshold, width)
                    };
                    let deviance: f64 = levels
                        .iter()
                        .map(|level| {
                            let correct = function.probability(level.level);
                            likelihood::deviance(level, correct, 1.0 - correct)
                        })
                        .sum();
                    assert!(
                        found.deviance <= deviance + 1e-6,
                        "set {set}: {function:?} has {deviance}, and {found:?} was found of {levels:?}"
                    );
                }
            }
        }
    }
}

/// What one of many subjects answers, 40 times at each of 7 levels: thresholds differ by 30 %.
fn subject(random: &mut Rng) -> Vec<Level> {
    let normal: f64 = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
    let scale = (0.3 * normal).exp();
    drawn(
        &observer(0.7 * scale, 0.8 * scale),
        40,
        [0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0],
        random,
    )
}

/// The fit to the answers of so many subjects, and its intervals.
fn together(subjects: &[Vec<Level>], draws: usize) -> (Psychometric, Bootstrap) {
    let fitted = best(&bootstrap::joined(subjects), None);
    let intervals = bootstrap_clusters(subjects, &fitted, draws, 1).expect("intervals");
    (fitted, intervals)
}

#[test]
fn the_interval_of_subjects_holds_the_threshold_of_all_people() {
    let mut random = Rng::with_seed(1);
    let many: Vec<Vec<Level>> = (0..4000).map(|_| subject(&mut random)).collect();
    let truth = best(&bootstrap::joined(&many), None).threshold;
    // Taken as independent answers, those of 8 subjects hold it in less than half of the studies.
    for count in [2, 8] {
        let held = (0..16).filter(|_| {
            let subjects: Vec<Vec<Level>> = (0..count).map(|_| subject(&mut random)).collect();
            let [low, high] = together(&subjects, 60).1.threshold_interval;
            low <= truth && truth <= high
        });
        let held = held.count();
        assert!(held >= 14, "{count} subjects: {held} of 16");
    }
}

#[test]
fn the_same_answers_under_new_codes_say_little_more() {
    let mut random = Rng::with_seed(1);
    let eight: Vec<Vec<Level>> = (0..8).map(|_| subject(&mut random)).collect();
    let (fitted, found) = together(&eight, 400);
    let (same, narrower) = together(&[&*eight, &*eight].concat(), 400);
    assert!((fitted.threshold - same.threshold).abs() < 1e-6, "{fitted:?} {same:?}");
    let width = |found: Bootstrap| found.threshold_interval[1] - found.threshold_interval[0];
    // Of 16 subjects Student's t and the correction are smaller as well: 2.20 after 2.53.
    let most = 2.0_f64.sqrt() * 2.53 / 2.20;
    let ratio = width(found) / width(narrower);
    assert!((1.1..most * 1.2).contains(&ratio), "{ratio}");
    // One subject's interval is that of its answers.
    let (fitted, alone) = together(&eight[..1], 100);
    assert_eq!(
        Some(alone),
        bootstrap(&eight[0], &fitted, Resampling::Parametric, 100, 1)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Answers of an observer whose function is known give it back, in whatever unit the levels are.
    #[test]
    fn a_known_observer_is_found(
        threshold in 0.3..0.7_f64,
        width in 0.3..0.8_f64,
        unit in 0.01..100.0_f64,
        seed in 0..1000_u64,
    ) {
        let truth = observer(threshold, width);
        let found = fit(&answers_of(&truth, unit, seed)).expect("a fit");
        prop_assert!((found.threshold / unit - threshold).abs() < 0.05, "{:?} of {:?}", found, truth);
        prop_assert!((found.width / unit / width - 1.0).abs() < 0.25, "{:?} of {:?}", found, truth);
    }

    /// A threshold below the lowest level has at least 70 % there, one above the highest at most 75 %.
    #[test]
    fn a_threshold_inside_is_not_refused_as_outside(
        lowest in 0..28_u32,
        upper in proptest::collection::vec(36..=40_u32, 2..6),
        lower in proptest::collection::vec(10..=20_u32, 2..6),
        highest in 31..=40_u32,
    ) {
        let levels = |counts: Vec<u32>| answered(40, (1..).map(|place| 0.1 * f64::from(place)).zip(counts));
        let is_at = |found: &Result<Psychometric, StatsError>, end: &str| {
            found.as_ref().is_err_and(|why| why.to_string().contains(end))
        };
        let above = fit(&levels([&[lowest], &*upper].concat()));
        prop_assert!(!is_at(&above, "at the lowest tested level"), "{:?}", above);
        let below = fit(&levels([&*lower, &[highest]].concat()));
        prop_assert!(!is_at(&below, "at the highest tested level"), "{:?}", below);
    }
}
