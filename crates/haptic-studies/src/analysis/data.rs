//! The analysis as tidy tables: a row for each observation, a value in each cell with all its digits, each column once.
//! An interval is two columns, `low` and `high`; a value that the trials do not determine is an empty cell. The first
//! column says who did the trials.

use super::FittsAnalysis;
use super::perception::{CaseAnalysis, PerceptionAnalysis, SubjectThreshold};
use super::tables::file;
use crate::subject_table::{SUBJECT, SubjectTable};
use crate::trial::Operator;
use haptic_lab::drawing::Table;
use haptic_lab::stats::mean::share_interval;

/// A column: its name, and its cell of a row.
type Column<T> = (&'static str, fn(&T) -> String);

fn table<T>(rows: impl IntoIterator<Item = T>, columns: &[Column<T>]) -> Table {
    let head = columns.iter().map(|(name, _)| (*name).to_owned()).collect();
    let cells = |row: T| columns.iter().map(|(_, cell)| cell(&row)).collect();
    Table {
        caption: String::new(),
        rows: std::iter::once(head).chain(rows.into_iter().map(cells)).collect(),
    }
}

/// The cell of a value that may be absent.
fn cell<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn low(interval: Option<[f64; 2]>) -> String {
    cell(interval.map(|[low, _]| low))
}

fn high(interval: Option<[f64; 2]>) -> String {
    cell(interval.map(|[_, high]| high))
}

/// The tidy tables of a targeting task, each under the name of its file. Tables of subjects have the free fields too.
#[must_use]
pub fn fitts_data(analysis: &FittsAnalysis, subjects: &SubjectTable) -> Vec<(String, Table)> {
    let mut tables = vec![("throughput".to_owned(), throughput(analysis))];
    for comparison in &analysis.comparisons {
        let counts = comparison.rows.iter().flat_map(|row| {
            let counts = comparison.resistances.iter().zip(&row.counts);
            counts.map(move |(resistance, counts)| (row, resistance, counts))
        });
        let counts = table(
            counts,
            &[
                ("condition", |(row, _, _)| row.condition.clone()),
                ("difficulty_bit", |(row, _, _)| row.difficulty_bit.to_string()),
                ("resistance", |(_, resistance, _)| (*resistance).clone()),
                ("better", |(_, _, counts)| counts.better.to_string()),
                ("worse", |(_, _, counts)| counts.worse.to_string()),
                ("same", |(_, _, counts)| counts.same.to_string()),
                ("sign_test_p", |(_, _, counts)| counts.sign_test_p.to_string()),
            ],
        );
        tables.push((file(comparison.measure).to_owned(), counts));
    }
    if !analysis.comparisons.is_empty() {
        tables.extend([
            ("totals".to_owned(), totals(analysis)),
            ("pairs".to_owned(), pairs(analysis)),
        ]);
    }
    if !analysis.beside_paper.is_empty() {
        tables.push(("beside-paper".to_owned(), beside_paper(analysis)));
    }
    tables.push(("difficulty".to_owned(), difficulty(analysis)));
    tables.push(("difficulty-points".to_owned(), difficulty_points(analysis)));
    tables.push(("sequences".to_owned(), with_fields(sequences(analysis), subjects)));
    tables.push(("differences".to_owned(), with_fields(differences(analysis), subjects)));
    by(analysis.operator, tables)
}

/// The tidy tables of a perception test, each under the name of its file.
#[must_use]
pub fn perception_data(analysis: &PerceptionAnalysis, subjects: &SubjectTable) -> Vec<(String, Table)> {
    let tables = vec![
        ("jnd".to_owned(), thresholds_by_case(analysis)),
        ("subjects".to_owned(), with_fields(thresholds(analysis), subjects)),
        ("psychometric".to_owned(), shares(analysis)),
    ];
    by(analysis.operator, tables)
}

/// The tables with a first column that says who did the trials, as in the trials themselves: empty where they do not.
fn by(operator: Option<Operator>, mut tables: Vec<(String, Table)>) -> Vec<(String, Table)> {
    let name = cell(operator.map(Operator::name));
    for (_, table) in &mut tables {
        for (place, row) in table.rows.iter_mut().enumerate() {
            let cell = if place == 0 { "operator" } else { name.as_str() };
            row.insert(0, cell.to_owned());
        }
    }
    tables
}

/// A table with a column `subject`, and the free fields of each subject behind.
fn with_fields(mut table: Table, subjects: &SubjectTable) -> Table {
    let place = table.rows[0].iter().position(|name| name == SUBJECT);
    for (index, row) in table.rows.iter_mut().enumerate() {
        let own = subjects
            .rows
            .iter()
            .find(|one| Some(&one.code) == place.map(|place| &row[place]));
        for (place, field) in subjects.fields.iter().enumerate() {
            row.push(match index {
                0 => format!("{SUBJECT}_{field}"),
                _ => cell(own.map(|one| one.values[place].clone())),
            });
        }
    }
    table
}

fn throughput(analysis: &FittsAnalysis) -> Table {
    table(
        analysis.by_resistance.iter().chain(&analysis.overall),
        &[
            ("resistance", |one| {
                one.resistance.clone().unwrap_or_else(|| "all".to_owned())
            }),
            ("sequences", |one| one.sequence_count.to_string()),
            ("subjects", |one| one.subject_count.to_string()),
            ("throughput_bit_per_s", |one| one.throughput_bit_per_s.to_string()),
            ("throughput_low_bit_per_s", |one| low(one.throughput_interval_bit_per_s)),
            ("throughput_high_bit_per_s", |one| {
                high(one.throughput_interval_bit_per_s)
            }),
            ("effective_amplitude_m", |one| one.effective_amplitude_m.to_string()),
            ("effective_width_m", |one| one.effective_width_m.to_string()),
            ("effective_id_bit", |one| one.effective_id_bit.to_string()),
            ("movement_time_s", |one| one.movement_time_s.to_string()),
            ("error_rate", |one| one.error_rate.to_string()),
        ],
    )
}

fn totals(analysis: &FittsAnalysis) -> Table {
    let totals = analysis.comparisons.iter().flat_map(|comparison| {
        let totals = comparison.resistances.iter().zip(&comparison.totals);
        totals.map(move |(resistance, total)| (comparison, resistance, total))
    });
    table(
        totals,
        &[
            ("measure", |(comparison, _, _)| comparison.measure.name().to_owned()),
            ("threshold", |(comparison, _, _)| comparison.threshold.to_string()),
            ("resistance", |(_, resistance, _)| (*resistance).clone()),
            ("better", |(_, _, total)| total.better.to_string()),
            ("worse", |(_, _, total)| total.worse.to_string()),
            ("same", |(_, _, total)| total.same.to_string()),
            ("subjects_better", |(_, _, total)| total.subjects_better.to_string()),
            ("subjects_worse", |(_, _, total)| total.subjects_worse.to_string()),
            ("sign_test_p", |(_, _, total)| total.sign_test_p.to_string()),
        ],
    )
}

fn pairs(analysis: &FittsAnalysis) -> Table {
    let pairs = analysis.comparisons.iter();
    let pairs = pairs.flat_map(|comparison| comparison.pairs.iter().map(move |pair| (comparison.measure, pair)));
    table(
        pairs,
        &[
            ("measure", |(measure, _)| measure.name().to_owned()),
            ("first", |(_, pair)| pair.first.clone()),
            ("second", |(_, pair)| pair.second.clone()),
            ("subjects_first", |(_, pair)| pair.subjects_first.to_string()),
            ("subjects_second", |(_, pair)| pair.subjects_second.to_string()),
            ("sign_test_p", |(_, pair)| pair.sign_test_p.to_string()),
        ],
    )
}

fn beside_paper(analysis: &FittsAnalysis) -> Table {
    table(
        &analysis.beside_paper,
        &[
            ("resistance", |one| one.resistance.clone()),
            ("paper_better", |one| one.paper[0].to_string()),
            ("paper_worse", |one| one.paper[1].to_string()),
            ("study_better", |one| one.study[0].to_string()),
            ("study_worse", |one| one.study[1].to_string()),
            ("fisher_p", |one| one.fisher_p.to_string()),
        ],
    )
}

fn difficulty(analysis: &FittsAnalysis) -> Table {
    table(
        &analysis.difficulty,
        &[
            ("resistance", |one| one.resistance.clone()),
            ("conditions", |one| one.points.len().to_string()),
            ("intercept_s", |one| cell(one.line.map(|line| line.intercept))),
            ("intercept_low_s", |one| {
                low(one.line.map(|line| line.intercept_interval))
            }),
            ("intercept_high_s", |one| {
                high(one.line.map(|line| line.intercept_interval))
            }),
            ("slope_s_per_bit", |one| cell(one.line.map(|line| line.slope))),
            ("slope_low_s_per_bit", |one| {
                low(one.line.map(|line| line.slope_interval))
            }),
            ("slope_high_s_per_bit", |one| {
                high(one.line.map(|line| line.slope_interval))
            }),
            ("r_squared", |one| cell(one.line.map(|line| line.r_squared))),
            ("residual_deviation_s", |one| {
                cell(one.line.map(|line| line.residual_deviation))
            }),
            ("refused", |one| cell(one.refused.as_ref())),
        ],
    )
}

fn difficulty_points(analysis: &FittsAnalysis) -> Table {
    let points = analysis.difficulty.iter();
    let points = points.flat_map(|one| one.points.iter().map(move |point| (&one.resistance, point)));
    table(
        points,
        &[
            ("resistance", |(resistance, _)| (*resistance).clone()),
            ("condition", |(_, point)| point.condition.clone()),
            ("difficulty_bit", |(_, point)| point.difficulty_bit.to_string()),
            ("movements", |(_, point)| point.movements.to_string()),
            ("movement_time_s", |(_, point)| point.movement_time_s.to_string()),
            ("movement_time_low_s", |(_, point)| low(point.movement_time_interval_s)),
            ("movement_time_high_s", |(_, point)| {
                high(point.movement_time_interval_s)
            }),
        ],
    )
}

fn sequences(analysis: &FittsAnalysis) -> Table {
    table(
        &analysis.sequences,
        &[
            (SUBJECT, |one| one.subject.clone()),
            ("block", |one| one.block.to_string()),
            ("resistance", |one| one.resistance.clone()),
            ("condition", |one| one.condition.clone()),
            ("trials", |one| one.trials.to_string()),
            ("error_rate", |one| one.error_rate.to_string()),
            ("effective_amplitude_m", |one| one.effective_amplitude_m.to_string()),
            ("end_deviation_m", |one| one.end_deviation_m.to_string()),
            ("effective_width_m", |one| one.effective_width_m.to_string()),
            ("effective_id_bit", |one| one.effective_id_bit.to_string()),
            ("movement_time_s", |one| one.movement_time_s.to_string()),
            ("throughput_bit_per_s", |one| one.throughput_bit_per_s.to_string()),
        ],
    )
}

fn differences(analysis: &FittsAnalysis) -> Table {
    table(
        &analysis.differences,
        &[
            (SUBJECT, |one| one.subject.clone()),
            ("resistance", |one| one.resistance.clone()),
            ("condition", |one| one.condition.clone()),
            ("difficulty_bit", |one| one.difficulty_bit.to_string()),
            ("time_s", |one| one.time_s.to_string()),
            ("errors", |one| one.errors.to_string()),
            ("error_size_m", |one| cell(one.error_size_m)),
        ],
    )
}

fn thresholds_by_case(analysis: &PerceptionAnalysis) -> Table {
    let mut table = table(
        &analysis.cases,
        &[
            ("case", |one| format!("{:?}", one.case)),
            ("method", |one| one.method.name().to_owned()),
            ("subjects", |one| one.subjects.len().to_string()),
            ("subjects_fitted", |one| {
                one.jnd_n.map_or(0, |mean| mean.count).to_string()
            }),
            ("jnd_N", |one| cell(one.jnd_n.map(|mean| mean.value))),
            ("jnd_low_N", |one| low(one.jnd_n.and_then(|mean| mean.interval))),
            ("jnd_high_N", |one| high(one.jnd_n.and_then(|mean| mean.interval))),
            ("subjects_by_staircase", |one| {
                one.staircase_n.map_or(0, |mean| mean.count).to_string()
            }),
            ("staircase_N", |one| cell(one.staircase_n.map(|mean| mean.value))),
            ("staircase_low_N", |one| {
                low(one.staircase_n.and_then(|mean| mean.interval))
            }),
            ("staircase_high_N", |one| {
                high(one.staircase_n.and_then(|mean| mean.interval))
            }),
            ("pooled_N", |one| cell(one.pooled.fit.map(|fit| fit.threshold))),
            ("pooled_low_N", |one| {
                low(one.pooled.intervals.map(|found| found.threshold_interval))
            }),
            ("pooled_high_N", |one| {
                high(one.pooled.intervals.map(|found| found.threshold_interval))
            }),
            ("pooled_width_N", |one| cell(one.pooled.width_n())),
            ("pooled_lapse", |one| cell(one.pooled.fit.map(|fit| fit.lapse))),
            ("pooled_refused", |one| cell(one.pooled.refused.as_ref())),
        ],
    );
    if analysis.cases.iter().any(|case| case.paper_jnd_n.is_some()) {
        table.rows[0].push("paper_jnd_N".to_owned());
        for (row, case) in table.rows[1..].iter_mut().zip(&analysis.cases) {
            row.push(cell(case.paper_jnd_n));
        }
    }
    table
}

fn thresholds(analysis: &PerceptionAnalysis) -> Table {
    let subjects = analysis.cases.iter();
    let subjects = subjects.flat_map(|case| case.subjects.iter().map(move |subject| (case, subject)));
    let columns: &[Column<(&CaseAnalysis, &SubjectThreshold)>] = &[
        (SUBJECT, |(_, one)| cell(one.subject.as_ref())),
        ("case", |(case, _)| format!("{:?}", case.case)),
        ("method", |(case, _)| case.method.name().to_owned()),
        ("trials", |(_, one)| one.trials.to_string()),
        ("threshold_N", |(_, one)| cell(one.fit.map(|fit| fit.threshold))),
        ("threshold_low_N", |(_, one)| {
            low(one.intervals.map(|found| found.threshold_interval))
        }),
        ("threshold_high_N", |(_, one)| {
            high(one.intervals.map(|found| found.threshold_interval))
        }),
        ("width_N", |(_, one)| cell(one.width_n())),
        ("width_low_N", |(_, one)| {
            low(one.intervals.map(|found| found.width_interval))
        }),
        ("width_high_N", |(_, one)| {
            high(one.intervals.map(|found| found.width_interval))
        }),
        ("lapse", |(_, one)| cell(one.fit.map(|fit| fit.lapse))),
        ("deviance", |(_, one)| cell(one.fit.map(|fit| fit.deviance))),
        ("worse_fits", |(_, one)| {
            cell(one.intervals.map(|found| found.worse_fits))
        }),
        ("refused", |(_, one)| cell(one.refused.as_ref())),
        ("staircase_N", |(_, one)| {
            cell(one.staircase.map(|found| found.threshold))
        }),
        ("staircase_deviation_N", |(_, one)| {
            cell(one.staircase.map(|found| found.deviation))
        }),
        ("staircase_reversals", |(_, one)| {
            cell(one.staircase.map(|found| found.reversals))
        }),
        ("staircase_refused", |(_, one)| cell(one.staircase_refused.as_ref())),
    ];
    table(subjects, columns)
}

/// What the figure of the psychometric functions shows: all subjects' answers by level.
fn shares(analysis: &PerceptionAnalysis) -> Table {
    let levels = analysis.cases.iter();
    let levels = levels.flat_map(|case| case.pooled.levels.iter().map(move |level| (case, level)));
    table(
        levels,
        &[
            ("case", |(case, _)| format!("{:?}", case.case)),
            ("method", |(case, _)| case.method.name().to_owned()),
            ("level_N", |(_, level)| level.level.to_string()),
            ("trials", |(_, level)| level.trials.to_string()),
            ("correct", |(_, level)| level.correct.to_string()),
            ("share", |(_, level)| {
                (f64::from(level.correct) / f64::from(level.trials)).to_string()
            }),
            ("share_low", |(_, level)| {
                low(Some(share_interval(level.correct, level.trials)))
            }),
            ("share_high", |(_, level)| {
                high(Some(share_interval(level.correct, level.trials)))
            }),
        ],
    )
}
