//! The analysis as tables for people: for a terminal of 80 columns, or for a page.

use super::comparison::{Comparison, Counts, Measure, Total};
use super::perception::{CaseAnalysis, PerceptionAnalysis, SubjectThreshold, unlike_means};
use super::{FittsAnalysis, Summary};
use crate::trial::{Method, Operator};
use haptic_lab::drawing::Table;

/// Letters in a row that the resistances of one table may take in a terminal, with two blanks before each.
pub const TERMINAL: usize = 56;
/// The same on a page: all resistances are in one table.
pub const PAGE: usize = usize::MAX;

/// The tables of a targeting task, each under the name of its file. Where the resistances take more than `room`
/// letters, they are in several tables.
#[must_use]
pub fn fitts_tables(analysis: &FittsAnalysis, room: usize) -> Vec<(String, Table)> {
    let mut tables = vec![("throughput".to_owned(), throughput(analysis))];
    for comparison in &analysis.comparisons {
        let parts = parts(&comparison.resistances, room);
        for (index, places) in parts.iter().enumerate() {
            let part = if parts.len() > 1 {
                format!("-{}", index + 1)
            } else {
                String::new()
            };
            tables.push((
                format!("{}{part}", file(comparison.measure)),
                counts(comparison, places),
            ));
        }
    }
    if analysis
        .comparisons
        .iter()
        .any(|comparison| !comparison.pairs.is_empty())
    {
        tables.push(("pairs".to_owned(), pairs(&analysis.comparisons)));
    }
    if !analysis.beside_paper.is_empty() {
        tables.push(("beside-paper".to_owned(), beside_paper(analysis)));
    }
    tables.push(("difficulty".to_owned(), difficulty(analysis)));
    marked(tables, analysis.operator)
}

/// What stands beside everything of a model's trials.
pub(super) const SIMULATED: &str = "simulated operator, not people";

/// Says in each caption that a model did the trials, if so: a table is copied without the notes.
fn marked(mut tables: Vec<(String, Table)>, operator: Option<Operator>) -> Vec<(String, Table)> {
    if operator == Some(Operator::Simulated) {
        for (_, table) in &mut tables {
            table.caption.push_str(&format!("; {SIMULATED}"));
        }
    }
    tables
}

fn table(caption: &str, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Table {
    let head = head.iter().map(|name| (*name).to_owned()).collect();
    Table {
        caption: caption.to_owned(),
        rows: std::iter::once(head).chain(rows).collect(),
    }
}

fn interval(interval: Option<[f64; 2]>, least: usize) -> String {
    interval.map_or_else(
        || "-".to_owned(),
        |[low, high]| {
            let decimals = decimals(high - low, least);
            format!("{low:.decimals$} to {high:.decimals$}")
        },
    )
}

/// Digits behind the point that show two of a size, and at least so many.
pub(super) fn decimals(size: f64, least: usize) -> usize {
    (least..9)
        .find(|&digits| size.abs() * 10.0_f64.powi(digits.try_into().unwrap_or(9)) >= 10.0)
        .unwrap_or(least)
}

/// A probability of a test.
fn probability(p: f64) -> String {
    if p < 0.001 {
        "<0.001".to_owned()
    } else {
        format!("{p:.3}")
    }
}

fn throughput(analysis: &FittsAnalysis) -> Table {
    let row = |summary: &Summary| {
        vec![
            summary.resistance.clone().unwrap_or_else(|| "all".to_owned()),
            summary.sequence_count.to_string(),
            format!("{:.3}", summary.throughput_bit_per_s),
            interval(summary.throughput_interval_bit_per_s, 2),
            format!("{:.1}", 1e3 * summary.effective_amplitude_m),
            format!("{:.1}", 1e3 * summary.effective_width_m),
            format!("{:.3}", summary.effective_id_bit),
            format!("{:.3}", summary.movement_time_s),
            format!("{:.1}", 1e2 * summary.error_rate),
        ]
    };
    table(
        "Throughput by ISO 9241-411: means over n sequences",
        &[
            "resistance",
            "n",
            "TP bit/s",
            "TP 95 %",
            "Ae mm",
            "We mm",
            "IDe bit",
            "MT s",
            "err %",
        ],
        analysis.by_resistance.iter().chain(&analysis.overall).map(row),
    )
}

/// The name of the file of a measure.
pub(super) fn file(measure: Measure) -> String {
    format!("table-{}-{}", measure.table(), measure.name().replace('_', "-"))
}

fn caption(comparison: &Comparison) -> String {
    let (measure, threshold) = (comparison.measure, comparison.threshold);
    let (what, size) = match measure {
        Measure::Time => ("Time of a segment", format!("{threshold} s")),
        Measure::Errors => ("Errors of a segment", threshold.to_string()),
        Measure::ErrorSize => ("Mean size of the errors", format!("{} mm", 1e3 * threshold)),
    };
    let table = measure.table();
    format!("{what}, better/worse by {size} (Richard and Cutkosky, Table {table})")
}

/// The resistances as they fit beside one another.
fn parts(resistances: &[String], room: usize) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut taken = 0;
    for (place, name) in resistances.iter().enumerate() {
        let width = 2 + name.chars().count().max(6);
        if parts.is_empty() || taken + width > room {
            parts.push(Vec::new());
            taken = 0;
        }
        taken += width;
        if let Some(part) = parts.last_mut() {
            part.push(place);
        }
    }
    parts
}

/// Better and worse by index of difficulty and resistance. A star marks a sign test below 0.05.
fn counts(comparison: &Comparison, places: &[usize]) -> Table {
    let row = |first: &str, second: &str, cell: &dyn Fn(usize) -> String| -> Vec<String> {
        let first = [first, second].map(str::to_owned);
        first
            .into_iter()
            .chain(places.iter().map(|&place| cell(place)))
            .collect()
    };
    let mut rows = vec![row("condition", "ID bit", &|place| {
        comparison.resistances[place].clone()
    })];
    rows.extend(comparison.rows.iter().map(|condition| {
        row(
            &condition.condition,
            &format!("{:.3}", condition.difficulty_bit),
            &|place| {
                let counts: &Counts = &condition.counts[place];
                let star = if counts.sign_test_p < 0.05 { "*" } else { "" };
                format!("{}/{}{star}", counts.better, counts.worse)
            },
        )
    }));
    let sums = |name: &str, cell: &dyn Fn(&Total) -> String| row(name, "", &|place| cell(&comparison.totals[place]));
    rows.extend([
        sums("sum", &|total| format!("{}/{}", total.better, total.worse)),
        sums("subjects", &|total| {
            format!("{}/{}", total.subjects_better, total.subjects_worse)
        }),
        sums("p", &|total| probability(total.sign_test_p)),
    ]);
    Table {
        caption: caption(comparison),
        rows,
    }
}

fn pairs(comparisons: &[Comparison]) -> Table {
    let rows = comparisons.iter().flat_map(|comparison| {
        comparison.pairs.iter().map(|pair| {
            vec![
                comparison.measure.name().replace('_', " "),
                pair.first.clone(),
                pair.second.clone(),
                pair.subjects_first.to_string(),
                pair.subjects_second.to_string(),
                probability(pair.sign_test_p),
            ]
        })
    });
    table(
        "Subjects that did better with the one or the other",
        &["measure", "one", "other", "with one", "with other", "p"],
        rows,
    )
}

fn beside_paper(analysis: &FittsAnalysis) -> Table {
    let rows = analysis.beside_paper.iter().map(|one| {
        let of = |[better, worse]: [u64; 2]| format!("{better}/{worse}");
        vec![
            one.resistance.clone(),
            of(one.paper),
            of(one.study),
            probability(one.fisher_p),
        ]
    });
    table(
        "Time better/worse, beside Richard and Cutkosky's 20 people",
        &["resistance", "paper", "this study", "Fisher p"],
        rows,
    )
}

fn difficulty(analysis: &FittsAnalysis) -> Table {
    let rows = analysis.difficulty.iter().filter_map(|one| {
        let line = one.line?;
        Some(vec![
            one.resistance.clone(),
            line.count.to_string(),
            format!("{:.3}", line.intercept),
            interval(Some(line.intercept_interval), 2),
            format!("{:.3}", line.slope),
            interval(Some(line.slope_interval), 2),
            format!("{:.3}", line.r_squared),
        ])
    });
    table(
        "Movement time = a + b ID, through the means of n conditions",
        &["resistance", "n", "a s", "a 95 %", "b s/bit", "b 95 %", "r2"],
        rows,
    )
}

/// The tables of a perception test, each under the name of its file.
#[must_use]
pub fn perception_tables(analysis: &PerceptionAnalysis) -> Vec<(String, Table)> {
    let has_paper = analysis.cases.iter().any(|case| case.paper_jnd_n.is_some());
    let mut heads = vec!["case", "n", "JND N", "JND 95 %", "stair N", "pooled N", "pooled 95 %"];
    let mut caption = "Just noticeable difference: mean of n subjects of all, and all answers together".to_owned();
    if has_paper {
        heads.push("paper N");
        caption.push_str("; paper: Richard and Cutkosky");
    }
    let cases = analysis.cases.iter().map(|case| {
        let paper = has_paper.then(|| {
            case.paper_jnd_n
                .map_or_else(|| "-".to_owned(), |jnd_n| format!("{jnd_n:.2}"))
        });
        case_row(case).into_iter().chain(paper).collect()
    });
    let subjects = analysis
        .cases
        .iter()
        .flat_map(|case| case.subjects.iter().map(move |subject| subject_row(case, subject)));
    let tables = vec![
        ("jnd".to_owned(), table(&caption, &heads, cases)),
        (
            "subjects".to_owned(),
            table(
                "By subject",
                &[
                    "subject", "case", "trials", "JND N", "JND 95 %", "width N", "lapse", "stair N",
                ],
                subjects,
            ),
        ),
    ];
    marked(tables, analysis.operator)
}

/// Why cells of a table of a perception test are empty: a line a reason, without advice, with the cells behind it.
pub(super) fn dashes(analysis: &PerceptionAnalysis, table: &str) -> Vec<String> {
    let mut reasons: Vec<(String, Vec<String>)> = Vec::new();
    let mut add = |reason: &str, cells: String| match reasons.iter_mut().find(|(known, _)| known == reason) {
        Some((_, known)) => known.push(cells),
        None => reasons.push((reason.to_owned(), vec![cells])),
    };
    const OPEN: &str =
        "neither interval nor width, as the answers do not bound them: they jump at a level, or hardly rise";
    for case in &analysis.cases {
        let name = name(case);
        let (own, of): (&[SubjectThreshold], _) = if table == "jnd" {
            match case.jnd_n {
                None => add("no subject's threshold is determined", name.clone()),
                Some(mean) if mean.count == 1 => add("one subject has no interval of a mean", name.clone()),
                Some(mean) if mean.interval.is_none() => add(OPEN, name.clone()),
                Some(_) => {}
            }
            (std::slice::from_ref(&case.pooled), "pooled".to_owned())
        } else {
            (&case.subjects, String::new())
        };
        for one in own {
            let cells = format!("{name}, {}", one.subject.as_ref().unwrap_or(&of));
            if let Some(why) = &one.staircase_refused {
                add(&why.reason, cells.clone());
            }
            if let Some(why) = &one.refused {
                add(&why.reason, cells);
            } else if one.intervals.is_none() {
                add(OPEN, cells);
            }
        }
        if case.method == Method::Constant {
            add("no staircase", name);
        } else if case.staircase_n.is_none() {
            add("the reversals determine no threshold", name);
        }
    }
    let lines = reasons
        .iter()
        .map(|(reason, cells)| format!("{reason}: {}", cells.join("; ")));
    let mut lines: Vec<String> = lines.collect();
    if let Some(first) = lines.first_mut() {
        first.insert_str(0, "-: ");
    }
    lines
}

/// What a table of a perception test would hide, though it is without dashes.
pub(super) fn footnotes(analysis: &PerceptionAnalysis, table: &str) -> Vec<String> {
    if table != "jnd" {
        return Vec::new();
    }
    let partial = analysis.cases.iter().filter_map(|case| {
        let (name, of) = (name(case), case.subjects.len());
        let count = case.jnd_n.map_or(0, |mean| mean.count);
        (0 < count && count < of).then(|| {
            format!(
                "{name}: the mean is of {count} of {of} subjects, as the thresholds of the others are not determined, \
                 which biases it towards the tested levels"
            )
        })
    });
    partial.chain(analysis.cases.iter().filter_map(unlike_means)).collect()
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.0$}", decimals(value, 3)))
}

/// Name of a case and its method.
fn name(case: &CaseAnalysis) -> String {
    format!("{:?} {}", case.case, case.method.name())
}

fn case_row(case: &CaseAnalysis) -> Vec<String> {
    vec![
        name(case),
        // A subject whose threshold is refused is not part of the mean.
        format!("{}/{}", case.jnd_n.map_or(0, |mean| mean.count), case.subjects.len()),
        number(case.jnd_n.map(|mean| mean.value)),
        interval(case.jnd_n.and_then(|mean| mean.interval), 2),
        number(case.staircase_n.map(|mean| mean.value)),
        number(case.pooled.fit.map(|fit| fit.threshold)),
        interval(case.pooled.intervals.map(|intervals| intervals.threshold_interval), 2),
    ]
}

fn subject_row(case: &CaseAnalysis, subject: &SubjectThreshold) -> Vec<String> {
    vec![
        subject.subject.clone().unwrap_or_default(),
        format!("{:?}", case.case),
        subject.trials.to_string(),
        number(subject.fit.map(|fit| fit.threshold)),
        interval(subject.intervals.map(|intervals| intervals.threshold_interval), 2),
        number(subject.width_n()),
        number(subject.fit.map(|fit| fit.lapse)),
        number(subject.staircase.map(|estimate| estimate.threshold)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_values_have_the_digits_that_they_need() {
        assert_eq!(interval(Some([1.1, 2.08]), 2), "1.10 to 2.08");
        assert_eq!(interval(Some([0.0011, 0.00208]), 2), "0.00110 to 0.00208");
        assert_eq!(interval(Some([0.0, 0.0]), 2), "0.00 to 0.00");
        assert_eq!(
            (number(Some(1.635)), number(Some(0.00163))),
            ("1.635".to_owned(), "0.0016".to_owned())
        );
    }

    #[test]
    fn resistances_that_do_not_fit_stand_in_a_table_of_their_own() {
        let names = |lengths: &[usize]| -> Vec<String> { lengths.iter().map(|length| "x".repeat(*length)).collect() };
        let parts = |lengths: &[usize], room| super::parts(&names(lengths), room);
        assert_eq!(parts(&[4, 9, 13, 7], TERMINAL), [vec![0, 1, 2, 3]]);
        assert_eq!(parts(&[30, 30, 10], TERMINAL), [vec![0], vec![1, 2]]);
        assert_eq!(parts(&[30, 30, 10], PAGE), [vec![0, 1, 2]]);
        assert_eq!(parts(&[90], TERMINAL), [vec![0]]);
        assert!(parts(&[], PAGE).is_empty());
    }
}
