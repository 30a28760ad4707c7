//! The analysis as tidy tables: a row for each observation, a value in each cell with all its digits, each column once.
//! An interval is two columns, `low` and `high`; a value that the trials do not determine is an empty cell. The first
//! column says who did the trials.

use super::FittsAnalysis;
use super::perception::PerceptionAnalysis;
use super::tables::file;
use crate::subject_table::{SUBJECT, SubjectTable};
use crate::trial::Operator;
use haptic_lab::drawing::Table;
use haptic_lab::stats::mean::share_interval;

/// A table that gets one column after the other.
struct Tidy<T> {
    rows: Vec<T>,
    table: Table,
}

impl<T> Tidy<T> {
    /// A table of these rows, whose first column says who did the trials; it is empty where they do not.
    fn of(operator: Option<Operator>, rows: impl IntoIterator<Item = T>) -> Self {
        let rows: Vec<T> = rows.into_iter().collect();
        let table = Table {
            caption: String::new(),
            rows: vec![Vec::new(); 1 + rows.len()],
        };
        Self { rows, table }.maybe("operator", |_| operator.map(Operator::name))
    }

    /// Adds a column.
    fn with<V: ToString>(self, name: &str, cell: impl Fn(&T) -> V) -> Self {
        self.maybe(name, |row| Some(cell(row)))
    }

    /// Adds a column of values that may be absent.
    fn maybe<V: ToString>(mut self, name: &str, cell: impl Fn(&T) -> Option<V>) -> Self {
        let cell = |row| cell(row).map_or_else(String::new, |value| value.to_string());
        let cells = std::iter::once(name.to_owned()).chain(self.rows.iter().map(cell));
        self.table
            .rows
            .iter_mut()
            .zip(cells)
            .for_each(|(row, cell)| row.push(cell));
        self
    }

    /// Adds the two columns of an interval. In their names, `low` and `high` stand for `{}`.
    fn interval(self, name: &str, cell: impl Fn(&T) -> Option<[f64; 2]>) -> Self {
        self.maybe(&name.replace("{}", "low"), |row| cell(row).map(|[low, _]| low))
            .maybe(&name.replace("{}", "high"), |row| cell(row).map(|[_, high]| high))
    }

    /// Adds the free fields of the subject of each row.
    fn with_fields(mut self, subjects: &SubjectTable, code: impl Fn(&T) -> Option<&String>) -> Self {
        for (place, field) in subjects.fields.iter().enumerate() {
            self = self.maybe(&format!("{SUBJECT}_{field}"), |row| {
                let own = subjects.rows.iter().find(|one| Some(&one.code) == code(row));
                own.map(|one| one.values[place].clone())
            });
        }
        self
    }
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
        let counts = Tidy::of(analysis.operator, counts)
            .with("condition", |(row, ..)| row.condition.clone())
            .with("difficulty_bit", |(row, ..)| row.difficulty_bit)
            .with("resistance", |(_, resistance, _)| (*resistance).clone())
            .with("better", |(.., counts)| counts.better)
            .with("worse", |(.., counts)| counts.worse)
            .with("same", |(.., counts)| counts.same)
            .with("sign_test_p", |(.., counts)| counts.sign_test_p);
        tables.push((file(comparison.measure), counts.table));
    }
    if !analysis.comparisons.is_empty() {
        tables.push(("totals".to_owned(), totals(analysis)));
        tables.push(("pairs".to_owned(), pairs(analysis)));
    }
    if !analysis.beside_paper.is_empty() {
        tables.push(("beside-paper".to_owned(), beside_paper(analysis)));
    }
    tables.push(("difficulty".to_owned(), difficulty(analysis)));
    tables.push(("difficulty-points".to_owned(), difficulty_points(analysis)));
    tables.push(("sequences".to_owned(), sequences(analysis, subjects)));
    tables.push(("differences".to_owned(), differences(analysis, subjects)));
    tables
}

/// The tidy tables of a perception test, each under the name of its file.
#[must_use]
pub fn perception_data(analysis: &PerceptionAnalysis, subjects: &SubjectTable) -> Vec<(String, Table)> {
    vec![
        ("jnd".to_owned(), thresholds_by_case(analysis)),
        ("subjects".to_owned(), thresholds(analysis, subjects)),
        ("psychometric".to_owned(), shares(analysis)),
    ]
}

fn throughput(analysis: &FittsAnalysis) -> Table {
    Tidy::of(
        analysis.operator,
        analysis.by_resistance.iter().chain(&analysis.overall),
    )
    .with("resistance", |one| {
        one.resistance.clone().unwrap_or_else(|| "all".to_owned())
    })
    .with("sequences", |one| one.sequence_count)
    .with("subjects", |one| one.subject_count)
    .with("throughput_bit_per_s", |one| one.throughput_bit_per_s)
    .interval("throughput_{}_bit_per_s", |one| one.throughput_interval_bit_per_s)
    .with("effective_amplitude_m", |one| one.effective_amplitude_m)
    .with("effective_width_m", |one| one.effective_width_m)
    .with("effective_id_bit", |one| one.effective_id_bit)
    .with("movement_time_s", |one| one.movement_time_s)
    .with("error_rate", |one| one.error_rate)
    .table
}

fn totals(analysis: &FittsAnalysis) -> Table {
    let totals = analysis.comparisons.iter().flat_map(|comparison| {
        let totals = comparison.resistances.iter().zip(&comparison.totals);
        totals.map(move |(resistance, total)| (comparison, resistance, total))
    });
    Tidy::of(analysis.operator, totals)
        .with("measure", |(comparison, ..)| comparison.measure.name())
        .with("threshold", |(comparison, ..)| comparison.threshold)
        .with("resistance", |(_, resistance, _)| (*resistance).clone())
        .with("better", |(.., total)| total.better)
        .with("worse", |(.., total)| total.worse)
        .with("same", |(.., total)| total.same)
        .with("subjects_better", |(.., total)| total.subjects_better)
        .with("subjects_worse", |(.., total)| total.subjects_worse)
        .with("sign_test_p", |(.., total)| total.sign_test_p)
        .table
}

fn pairs(analysis: &FittsAnalysis) -> Table {
    let pairs = analysis.comparisons.iter();
    let pairs = pairs.flat_map(|comparison| comparison.pairs.iter().map(move |pair| (comparison.measure, pair)));
    Tidy::of(analysis.operator, pairs)
        .with("measure", |(measure, _)| measure.name())
        .with("first", |(_, pair)| pair.first.clone())
        .with("second", |(_, pair)| pair.second.clone())
        .with("subjects_first", |(_, pair)| pair.subjects_first)
        .with("subjects_second", |(_, pair)| pair.subjects_second)
        .with("sign_test_p", |(_, pair)| pair.sign_test_p)
        .table
}

fn beside_paper(analysis: &FittsAnalysis) -> Table {
    Tidy::of(analysis.operator, &analysis.beside_paper)
        .with("resistance", |one| one.resistance.clone())
        .with("paper_better", |one| one.paper[0])
        .with("paper_worse", |one| one.paper[1])
        .with("study_better", |one| one.study[0])
        .with("study_worse", |one| one.study[1])
        .with("fisher_p", |one| one.fisher_p)
        .table
}

fn difficulty(analysis: &FittsAnalysis) -> Table {
    Tidy::of(analysis.operator, &analysis.difficulty)
        .with("resistance", |one| one.resistance.clone())
        .with("conditions", |one| one.points.len())
        .maybe("intercept_s", |one| one.line.map(|line| line.intercept))
        .interval("intercept_{}_s", |one| one.line.map(|line| line.intercept_interval))
        .maybe("slope_s_per_bit", |one| one.line.map(|line| line.slope))
        .interval("slope_{}_s_per_bit", |one| one.line.map(|line| line.slope_interval))
        .maybe("r_squared", |one| one.line.map(|line| line.r_squared))
        .maybe("residual_deviation_s", |one| {
            one.line.map(|line| line.residual_deviation)
        })
        .maybe("refused", |one| one.refused.clone())
        .table
}

fn difficulty_points(analysis: &FittsAnalysis) -> Table {
    let points = analysis.difficulty.iter();
    let points = points.flat_map(|one| one.points.iter().map(move |point| (&one.resistance, point)));
    Tidy::of(analysis.operator, points)
        .with("resistance", |(resistance, _)| (*resistance).clone())
        .with("condition", |(_, point)| point.condition.clone())
        .with("difficulty_bit", |(_, point)| point.difficulty_bit)
        .with("movements", |(_, point)| point.movements)
        .with("movement_time_s", |(_, point)| point.movement_time_s)
        .interval("movement_time_{}_s", |(_, point)| point.movement_time_interval_s)
        .table
}

fn sequences(analysis: &FittsAnalysis, subjects: &SubjectTable) -> Table {
    Tidy::of(analysis.operator, &analysis.sequences)
        .with(SUBJECT, |one| one.subject.clone())
        .with("block", |one| one.block)
        .with("resistance", |one| one.resistance.clone())
        .with("condition", |one| one.condition.clone())
        .with("trials", |one| one.trials)
        .with("error_rate", |one| one.error_rate)
        .with("effective_amplitude_m", |one| one.throughput.effective_amplitude_m)
        .with("end_deviation_m", |one| one.throughput.end_deviation_m)
        .with("effective_width_m", |one| one.throughput.effective_width_m)
        .with("effective_id_bit", |one| one.throughput.effective_id_bit)
        .with("movement_time_s", |one| one.throughput.movement_time_s)
        .with("throughput_bit_per_s", |one| one.throughput.throughput_bit_per_s)
        .with_fields(subjects, |one| Some(&one.subject))
        .table
}

fn differences(analysis: &FittsAnalysis, subjects: &SubjectTable) -> Table {
    Tidy::of(analysis.operator, &analysis.differences)
        .with(SUBJECT, |one| one.subject.clone())
        .with("resistance", |one| one.resistance.clone())
        .with("condition", |one| one.condition.clone())
        .with("difficulty_bit", |one| one.difficulty_bit)
        .with("time_s", |one| one.time_s)
        .with("errors", |one| one.errors)
        .maybe("error_size_m", |one| one.error_size_m)
        .with_fields(subjects, |one| Some(&one.subject))
        .table
}

fn thresholds_by_case(analysis: &PerceptionAnalysis) -> Table {
    let tidy = Tidy::of(analysis.operator, &analysis.cases)
        .with("case", |one| format!("{:?}", one.case))
        .with("method", |one| one.method.name())
        .with("subjects", |one| one.subjects.len())
        .with("subjects_fitted", |one| one.jnd_n.map_or(0, |mean| mean.count))
        .maybe("jnd_N", |one| one.jnd_n.map(|mean| mean.value))
        .interval("jnd_{}_N", |one| one.jnd_n?.interval)
        .with("subjects_by_staircase", |one| {
            one.staircase_n.map_or(0, |mean| mean.count)
        })
        .maybe("staircase_N", |one| one.staircase_n.map(|mean| mean.value))
        .interval("staircase_{}_N", |one| one.staircase_n?.interval)
        .maybe("pooled_N", |one| one.pooled.fit.map(|fit| fit.threshold))
        .interval("pooled_{}_N", |one| Some(one.pooled.intervals?.threshold_interval))
        .maybe("pooled_width_N", |one| one.pooled.width_n())
        .maybe("pooled_lapse", |one| one.pooled.fit.map(|fit| fit.lapse))
        .maybe("pooled_refused", |one| one.pooled.refused.clone());
    if analysis.cases.iter().any(|case| case.paper_jnd_n.is_some()) {
        return tidy.maybe("paper_jnd_N", |one| one.paper_jnd_n).table;
    }
    tidy.table
}

fn thresholds(analysis: &PerceptionAnalysis, subjects: &SubjectTable) -> Table {
    let all = analysis.cases.iter();
    let all = all.flat_map(|case| case.subjects.iter().map(move |subject| (case, subject)));
    Tidy::of(analysis.operator, all)
        .maybe(SUBJECT, |(_, one)| one.subject.clone())
        .with("case", |(case, _)| format!("{:?}", case.case))
        .with("method", |(case, _)| case.method.name())
        .with("trials", |(_, one)| one.trials)
        .maybe("threshold_N", |(_, one)| one.fit.map(|fit| fit.threshold))
        .interval("threshold_{}_N", |(_, one)| Some(one.intervals?.threshold_interval))
        .maybe("width_N", |(_, one)| one.width_n())
        .interval("width_{}_N", |(_, one)| Some(one.intervals?.width_interval))
        .maybe("lapse", |(_, one)| one.fit.map(|fit| fit.lapse))
        .maybe("deviance", |(_, one)| one.fit.map(|fit| fit.deviance))
        .maybe("worse_fits", |(_, one)| one.intervals.map(|found| found.worse_fits))
        .maybe("refused", |(_, one)| one.refused.clone())
        .maybe("staircase_N", |(_, one)| one.staircase.map(|found| found.threshold))
        .maybe("staircase_deviation_N", |(_, one)| {
            one.staircase.map(|found| found.deviation)
        })
        .maybe("staircase_reversals", |(_, one)| {
            one.staircase.map(|found| found.reversals)
        })
        .maybe("staircase_refused", |(_, one)| one.staircase_refused.clone())
        .with_fields(subjects, |(_, one)| one.subject.as_ref())
        .table
}

/// What the figure of the psychometric functions shows: all subjects' answers by level.
fn shares(analysis: &PerceptionAnalysis) -> Table {
    let levels = analysis.cases.iter();
    let levels = levels.flat_map(|case| case.pooled.levels.iter().map(move |level| (case, level)));
    Tidy::of(analysis.operator, levels)
        .with("case", |(case, _)| format!("{:?}", case.case))
        .with("method", |(case, _)| case.method.name())
        .with("level_N", |(_, level)| level.level)
        .with("trials", |(_, level)| level.trials)
        .with("correct", |(_, level)| level.correct)
        .with("share", |(_, level)| f64::from(level.correct) / f64::from(level.trials))
        .interval("share_{}", |(_, level)| {
            Some(share_interval(level.correct, level.trials))
        })
        .table
}
