//! The analysis as a page: tables, quadrant plots, Fitts's law, trajectories, psychometric functions.

use super::perception::{CaseAnalysis, PerceptionAnalysis};
use super::tables::{fitts_tables, perception_tables};
use super::trajectories::Trajectory;
use super::{Difference, FittsAnalysis, Refusal};
use haptic_lab::drawing::{Chart, Page, Table, Trace};
use std::collections::BTreeSet;

/// Height of the smaller charts, px.
const SMALL_PX: f64 = 220.0;
/// Points of a curve.
const CURVE: usize = 200;

/// The charts of a targeting task, by the name of the picture that holds them.
pub(super) fn fitts_charts(analysis: &FittsAnalysis, trajectories: &[Trajectory]) -> Vec<(&'static str, Vec<Chart>)> {
    let resistances = analysis.comparisons.first().map(|comparison| &comparison.resistances);
    let quadrants = resistances.into_iter().flatten();
    let quadrants = quadrants.flat_map(|resistance| quadrants_of(&analysis.differences, resistance));
    vec![
        ("difficulty", vec![difficulty(analysis)]),
        ("quadrants", quadrants.collect()),
        ("trajectories", courses(trajectories)),
    ]
}

/// The charts of a perception test, by the name of the picture that holds them.
pub(super) fn perception_charts(analysis: &PerceptionAnalysis) -> Vec<(&'static str, Vec<Chart>)> {
    vec![("psychometric", analysis.cases.iter().map(psychometric).collect())]
}

/// The page of a targeting task.
pub(super) fn fitts_page(analysis: &FittsAnalysis, charts: Vec<Chart>, title: &str) -> Page {
    page(
        title,
        charts,
        fitts_tables(analysis),
        &analysis.refused,
        &analysis.notes,
    )
}

/// The page of a perception test.
pub(super) fn perception_page(analysis: &PerceptionAnalysis, charts: Vec<Chart>, title: &str) -> Page {
    page(
        title,
        charts,
        perception_tables(analysis),
        &analysis.refused,
        &analysis.notes,
    )
}

fn page(title: &str, charts: Vec<Chart>, tables: Vec<(String, Table)>, refused: &[Refusal], notes: &[String]) -> Page {
    let refused = refused
        .iter()
        .map(|one| format!("Not found: {}: {}", one.what, one.reason));
    Page {
        title: title.to_owned(),
        paragraphs: notes.iter().cloned().chain(refused).collect(),
        charts,
        tables: tables.into_iter().map(|(_, table)| table).collect(),
    }
}

/// Means by condition, and the lines through them.
fn difficulty(analysis: &FittsAnalysis) -> Chart {
    let mut chart = Chart::new(
        "Movement time against difficulty",
        "Index of difficulty (bit)",
        "Movement time (s)",
    );
    for (colour, one) in analysis.difficulty.iter().enumerate() {
        let points: Vec<[f64; 2]> = one
            .points
            .iter()
            .map(|point| [point.difficulty_bit, point.movement_time_s])
            .collect();
        let ends = one
            .line
            .zip(points.first().zip(points.last()))
            .map(|(line, (first, last))| {
                [first[0], last[0]].map(|difficulty| [difficulty, line.intercept + line.slope * difficulty])
            });
        chart = chart.with(Trace::dots(one.resistance.as_str(), points).in_colour(colour));
        if let Some(ends) = ends {
            chart = chart.with(Trace::line("", ends.to_vec()).in_colour(colour));
        }
    }
    chart
}

/// Difference in time against difference in errors, and in their size.
fn quadrants_of(differences: &[Difference], resistance: &str) -> Vec<Chart> {
    let own: Vec<&Difference> = differences.iter().filter(|one| one.resistance == resistance).collect();
    let errors = own.iter().map(|one| [one.errors, one.time_s]).collect();
    let sizes: Vec<[f64; 2]> = own
        .iter()
        .filter_map(|one| Some([1e3 * one.error_size_m?, one.time_s]))
        .collect();
    let mut charts = vec![quadrant(resistance, "errors", "Errors, less the baseline's", errors)];
    if !sizes.is_empty() {
        charts.push(quadrant(
            resistance,
            "size",
            "Mean size of errors, less the baseline's (mm)",
            sizes,
        ));
    }
    charts
}

fn quadrant(resistance: &str, what: &str, across: &str, points: Vec<[f64; 2]>) -> Chart {
    let reach = |axis: usize| points.iter().map(|point| point[axis].abs()).fold(1.0, f64::max) * 1.1;
    let (x, y) = (reach(0), reach(1));
    let axes = vec![[-x, 0.0], [x, 0.0], [f64::NAN, f64::NAN], [0.0, -y], [0.0, y]];
    let mut chart = Chart::new(
        format!("{resistance}: time against {what}; left is better, below is better"),
        across,
        "Time of a segment, less the baseline's (s)",
    )
    .with(Trace::dots("subject and condition", points))
    .with(Trace::dashed("as the baseline", axes).in_colour(4));
    (chart.across.range, chart.up.range) = (Some((-x, x)), Some((-y, y)));
    chart.height_px = SMALL_PX;
    chart
}

/// A chart for each condition, a trace for each resistance.
fn courses(trajectories: &[Trajectory]) -> Vec<Chart> {
    let conditions: BTreeSet<&str> = trajectories.iter().map(|one| one.condition.as_str()).collect();
    conditions
        .into_iter()
        .map(|condition| {
            let own = trajectories.iter().filter(|one| one.condition == condition);
            let subject = own.clone().next().map_or("", |one| one.subject.as_str());
            let chart = Chart::new(
                format!("A movement under each resistance: subject {subject}, condition {condition}"),
                "Time since the target became active (s)",
                "Way of the handle along the movement (mm)",
            );
            own.fold(chart, |chart, one| {
                let points = one.points.iter().map(|[t_s, way_m]| [*t_s, 1e3 * way_m]).collect();
                chart.with(Trace::line(one.resistance.as_str(), points))
            })
        })
        .collect()
}

/// The shares of correct answers, and the function through them.
fn psychometric(case: &CaseAnalysis) -> Chart {
    let levels = &case.pooled.levels;
    let shares = levels
        .iter()
        .map(|level| [level.level, f64::from(level.correct) / f64::from(level.trials)])
        .collect();
    let mut chart = Chart::new(
        format!("Case {:?}: correct answers of all subjects", case.case),
        "Change of friction (N)",
        "Share of correct answers",
    )
    .with(Trace::dots("seen", shares));
    let ends = levels.first().zip(levels.last());
    if let Some((fit, (first, last))) = case.pooled.fit.zip(ends) {
        #[expect(clippy::cast_precision_loss, reason = "points of a curve")]
        let curve = (0..=CURVE)
            .map(|place| first.level + (last.level - first.level) * place as f64 / CURVE as f64)
            .map(|level| [level, fit.probability(level)])
            .collect();
        let threshold = vec![[fit.threshold, 0.5], [fit.threshold, fit.probability(fit.threshold)]];
        chart = chart
            .with(Trace::line("fitted", curve))
            .with(Trace::dashed(format!("threshold {:.3} N", fit.threshold), threshold));
    }
    chart.up.range = Some((0.4, 1.02));
    chart
}
