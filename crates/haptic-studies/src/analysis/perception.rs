//! Just noticeable differences by case.

use super::error::{AnalysisError, Reason, Refusal};
use super::paper;
use crate::plan::{DROPPED_REVERSALS, PerceptionPlan, Staircase};
use crate::trial::{Case, Method, Operator, PerceptionTrial};
use haptic_lab::stats::mean::{Mean, clustered_mean};
use haptic_lab::stats::psychometric::{Bootstrap, Level, MAX_LAPSE, Psychometric, bootstrap_clusters, by_level, fit};
use haptic_lab::stats::staircase::{StaircaseEstimate, staircase};
use serde::Serialize;
use std::collections::BTreeMap;

/// How often answers are drawn again for an interval.
const DRAWS: usize = 500;

/// The threshold of a subject, or of all of them together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectThreshold {
    /// Code of the subject; absent for all subjects' answers together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
    /// Number of answers.
    pub trials: usize,
    /// The answers by level, N: how many were correct, and how many there are.
    #[serde(skip)]
    pub levels: Vec<Level>,
    /// The fitted function; threshold and width in N. Absent where the answers do not determine it.
    pub fit: Option<Psychometric>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<Reason>,
    /// Its intervals, N. Absent where the answers do not bound them: they jump at a level, or hardly rise.
    pub intervals: Option<Bootstrap>,
    /// The mean of the reversals, N, where the levels are a staircase's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub staircase: Option<StaircaseEstimate>,
    /// Why there is none, where they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub staircase_refused: Option<Reason>,
}

impl SubjectThreshold {
    /// Width of the fitted function, N. Absent where the answers do not bound it.
    pub(super) fn width_n(&self) -> Option<f64> {
        self.intervals.as_ref().and(self.fit).map(|fit| fit.width)
    }
}

/// What the answers to a case say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseAnalysis {
    /// What the comparison changed.
    pub case: Case,
    /// How the levels were chosen.
    pub method: Method,
    /// The just noticeable difference: mean of the subjects' fitted thresholds, N. Absent where none is determined.
    #[serde(rename = "jnd_N")]
    pub jnd_n: Option<Mean>,
    /// The same from the staircases, N.
    #[serde(rename = "staircase_N", skip_serializing_if = "Option::is_none")]
    pub staircase_n: Option<Mean>,
    /// That of the paper, N; absent where the study's base is another one, or not known.
    #[serde(rename = "paper_jnd_N", skip_serializing_if = "Option::is_none")]
    pub paper_jnd_n: Option<f64>,
    /// All subjects' answers together.
    pub pooled: SubjectThreshold,
    /// Each subject.
    pub subjects: Vec<SubjectThreshold>,
}

/// What the answers of a perception test say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PerceptionAnalysis {
    /// Whether people or a model answered, where the rows say so.
    pub operator: Option<Operator>,
    /// Number of trials.
    pub trials: usize,
    /// By case and method.
    pub cases: Vec<CaseAnalysis>,
    /// What the answers do not show.
    pub refused: Vec<Refusal>,
    /// Remarks for people.
    pub notes: Vec<String>,
}

impl PerceptionAnalysis {
    /// Puts the paper's values beside those of a study by this plan, where they compare.
    pub fn put_beside_paper(&mut self, plan: &PerceptionPlan) {
        let has_base = paper::has_base(plan);
        for case in &mut self.cases {
            case.paper_jnd_n = has_base.then(|| paper::jnd_n(case.case));
        }
    }
}

/// The trials of a case by subject, session and number.
type BySubject<'a> = BTreeMap<&'a str, BTreeMap<(u32, u32), &'a PerceptionTrial>>;

/// Analyses the answers of a perception test, in any order. The plan, where it is known, says between which levels a
/// staircase went. The seed is that of the intervals.
///
/// # Errors
/// There are no trials, or two are the same one.
pub fn perception(
    trials: &[PerceptionTrial],
    plan: Option<&PerceptionPlan>,
    seed: u64,
) -> Result<PerceptionAnalysis, AnalysisError> {
    let Some(first) = trials.first() else {
        return Err(AnalysisError::no_trials());
    };
    if trials.iter().any(|trial| trial.operator != first.operator) {
        return Err(AnalysisError::mixed_operators());
    }
    let mut by_case: BTreeMap<_, BySubject<'_>> = BTreeMap::new();
    for trial in trials {
        let case = by_case.entry((trial.case, trial.method)).or_default();
        let own = case.entry(trial.subject.as_str()).or_default();
        if own.insert((trial.session, trial.trial), trial).is_some() {
            let PerceptionTrial {
                subject, session, case, ..
            } = trial;
            let sequence = format!("subject {subject}, session {session}, case {case:?}");
            return Err(AnalysisError::twice(trial.trial, &sequence));
        }
    }
    let mut refused = Vec::new();
    let cases: Vec<CaseAnalysis> = by_case
        .into_iter()
        .map(|((case, method), subjects)| {
            let staircases = plan.into_iter().flat_map(|plan| &plan.tests);
            let mut staircases = staircases.filter(|test| test.case == case && test.method() == method);
            let range = staircases.find_map(|test| test.staircase.as_ref());
            analysed((case, method), &subjects, range, seed, &mut refused)
        })
        .collect();
    let mut notes = Vec::new();
    if first.operator == Some(Operator::Simulated) {
        notes.push("a model gave these answers: they say nothing about people".to_owned());
    }
    if plan.is_none() && cases.iter().any(|case| case.staircase_n.is_some()) {
        notes.push(
            "without the plan, which is in a study's folder, nobody knows at which levels a staircase could not go on: \
             means of reversals are not refused for that"
                .to_owned(),
        );
    }
    notes.extend(contradictions(trials));
    notes.extend(cases.iter().filter_map(unlike_means));
    notes.extend(cases.iter().flat_map(at_bounds));
    Ok(PerceptionAnalysis {
        operator: first.operator,
        trials: trials.len(),
        cases,
        refused,
        notes,
    })
}

/// Says how many answers are not what `correct` says of them.
fn contradictions(trials: &[PerceptionTrial]) -> Option<String> {
    let is_contradicted = |trial: &&PerceptionTrial| {
        let base = trial.base_static_n + trial.base_dynamic_n;
        let comparison_has_more = trial.comparison_static_n + trial.comparison_dynamic_n > base;
        let first_has_more = trial.comparison_first == comparison_has_more;
        trial.level_n > 0.0 && trial.correct != ((trial.answer == 1) == first_has_more)
    };
    let mut contradicted = trials.iter().filter(is_contradicted);
    let first = contradicted.next()?;
    Some(format!(
        "correct is not what answer and comparison_first say in {} of {} rows, the first of them trial {} of subject {}, \
         case {:?}: correct is taken",
        1 + contradicted.count(),
        trials.len(),
        first.trial,
        first.subject,
        first.case
    ))
}

/// Says where the two means of a case are not of as many subjects.
pub(super) fn unlike_means(case: &CaseAnalysis) -> Option<String> {
    let (fitted, staircase) = (case.jnd_n?.count, case.staircase_n?.count);
    (fitted != staircase).then(|| {
        format!(
            "case {:?}: the JND is the mean of {fitted} of the subjects, that of the staircases of {staircase}",
            case.case
        )
    })
}

/// Says which functions run into a bound.
fn at_bounds(case: &CaseAnalysis) -> Vec<String> {
    let mut notes = Vec::new();
    for found in std::iter::once(&case.pooled).chain(&case.subjects) {
        let Some(fit) = &found.fit else { continue };
        let of = found.subject.as_ref().map_or_else(
            || format!("all subjects together, case {:?}", case.case),
            |subject| format!("subject {subject}, case {:?}", case.case),
        );
        let distance = |level: &Level| (level.level - fit.threshold).abs();
        let nearest = found.levels.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest.filter(|_| fit.is_step(&found.levels)) {
            notes.push(format!(
                "{of}: the answers jump at the level of {} N: any narrower function fits as well, so that it has no width, \
                 and the threshold is near that level, the only one tested there, so that it has no interval",
                nearest.level
            ));
        } else if found.intervals.is_none() {
            notes.push(format!(
                "{of}: the answers get so little better with the level that they bound neither threshold nor width: \
                 neither has an interval"
            ));
        }
        if fit.is_lapse_at_bound() {
            notes.push(format!(
                "{of}: the share of lapses is at its bound of {MAX_LAPSE}: more answers are wrong at large differences \
                 than it allows, and the threshold may be too low"
            ));
        }
    }
    notes
}

fn analysed(
    (case, method): (Case, Method),
    subjects: &BySubject<'_>,
    range: Option<&Staircase>,
    seed: u64,
    refused: &mut Vec<Refusal>,
) -> CaseAnalysis {
    let mut refuse = |what: &str, of: &str, why: Reason| {
        refused.push(Refusal {
            what: format!("{what} of {of}, case {case:?}"),
            why,
        });
    };
    let everything: Vec<Vec<&PerceptionTrial>> = subjects.values().map(of_subject).collect();
    let pooled = threshold(None, &everything, seed);
    if let Some(why) = &pooled.refused {
        refuse("threshold", "all subjects together", why.clone());
    }
    let own = subjects.iter().map(|(subject, trials)| {
        let of = format!("subject {subject}");
        let mut found = threshold(Some(subject), &[of_subject(trials)], seed);
        if let Some(why) = &found.refused {
            refuse("threshold", &of, why.clone());
        }
        if method == Method::Staircase {
            let own: Vec<&PerceptionTrial> = of_subject(trials);
            match mean_of_reversals(&own, range) {
                Ok(estimate) => found.staircase = Some(estimate),
                Err(why) => {
                    refuse("staircase", &of, why.clone());
                    found.staircase_refused = Some(why);
                }
            }
        }
        found
    });
    let subjects: Vec<SubjectThreshold> = own.collect();
    let mean_of = |value: &dyn Fn(&SubjectThreshold) -> Option<f64>| {
        let clusters: Vec<Vec<f64>> = subjects.iter().filter_map(value).map(|one| vec![one]).collect();
        (!clusters.is_empty()).then(|| clustered_mean(&clusters))
    };
    // Thresholds at one level are alike because of the levels, not of the subjects.
    let is_known = subjects.iter().all(|one| one.fit.is_none() == one.intervals.is_none());
    let fitted = mean_of(&|one| one.fit.map(|fit| fit.threshold)).map(|mean| Mean {
        interval: mean
            .interval
            .or((mean.count > 1).then_some([mean.value; 2]))
            .filter(|_| is_known)
            .map(|interval| no_surer(interval, mean.value, &subjects)),
        ..mean
    });
    CaseAnalysis {
        case,
        method,
        jnd_n: fitted,
        staircase_n: mean_of(&|one| one.staircase.map(|estimate| estimate.threshold)),
        paper_jnd_n: None,
        pooled,
        subjects,
    }
}

/// The interval of a mean, at least as wide as the intervals of its subjects' thresholds make it: those of few subjects
/// may be alike by chance.
fn no_surer([low, high]: [f64; 2], mean: f64, subjects: &[SubjectThreshold]) -> [f64; 2] {
    let own = || {
        let found = subjects.iter().filter_map(|one| one.fit.zip(one.intervals));
        found.map(|(fit, intervals)| intervals.threshold_interval.map(|end| end - fit.threshold))
    };
    let half = |end: usize| own().map(|ends| ends[end].powi(2)).sum::<f64>().sqrt() / own().count() as f64;
    [low.min(mean - half(0)), high.max(mean + half(1))]
}

/// The mean level at which the staircase of a subject turned, or why it has none.
fn mean_of_reversals(trials: &[&PerceptionTrial], range: Option<&Staircase>) -> Result<StaircaseEstimate, Reason> {
    /// Levels are rounded to a millionth of a newton.
    const SAME_N: f64 = 1e-6;
    let turns = trials.iter().filter(|one| one.reversal);
    let turns: Vec<(f64, bool)> = turns.map(|one| (one.level_n, one.correct)).collect();
    let levels: Vec<f64> = turns.iter().map(|(level_n, _)| *level_n).collect();
    let estimate = staircase(&levels, DROPPED_REVERSALS as usize)?;
    let ends = range.map(|range| {
        [
            // A correct answer turns it at the top, a wrong one at the bottom.
            (false, "bottom", "smallest_N", range.smallest_n, "smaller"),
            (true, "top", "largest_N", range.largest_n, "larger"),
        ]
    });
    for (correct, place, field, end_n, wanted) in ends.into_iter().flatten() {
        let here = turns[estimate.dropped..]
            .iter()
            .filter(|(_, turned)| *turned == correct);
        let all = here.clone().count();
        let held = here.filter(|(level_n, _)| (level_n - end_n).abs() < SAME_N).count();
        if held > 0 && 2 * held >= all {
            return Err(Reason {
                reason: format!(
                    "{held} of the {all} reversals at the {place} are at {field} = {end_n} N, where the staircase could \
                     not go on"
                ),
                advice: Some(format!("test {wanted} levels")),
            });
        }
    }
    Ok(estimate)
}

fn of_subject<'a>(trials: &BTreeMap<(u32, u32), &'a PerceptionTrial>) -> Vec<&'a PerceptionTrial> {
    trials.values().copied().collect()
}

/// The threshold of the answers of some subjects, or why they have none.
fn threshold(subject: Option<&str>, subjects: &[Vec<&PerceptionTrial>], seed: u64) -> SubjectThreshold {
    let own = |trial: &&PerceptionTrial| (trial.level_n, trial.correct);
    let levels = by_level(subjects.iter().flatten().map(own));
    let (fit, refused) = match fit(&levels) {
        Ok(fit) => (Some(fit), None),
        Err(error) => (None, Some(error.into())),
    };
    let by_subject = || -> Vec<Vec<Level>> { subjects.iter().map(|trials| by_level(trials.iter().map(own))).collect() };
    SubjectThreshold {
        subject: subject.map(str::to_owned),
        trials: subjects.iter().map(Vec::len).sum(),
        intervals: fit.and_then(|fit| bootstrap_clusters(&by_subject(), &fit, DRAWS, seed)),
        levels,
        fit,
        refused,
        staircase: None,
        staircase_refused: None,
    }
}
