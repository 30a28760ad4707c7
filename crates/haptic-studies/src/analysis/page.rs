//! The analysis as a page: tables, quadrant plots, Fitts's law, trajectories, psychometric functions.

use super::perception::{CaseAnalysis, PerceptionAnalysis};
use super::tables::{SIMULATED, decimals};
use super::trajectories::Trajectory;
use super::{Difference, FittsAnalysis, Refusal};
use crate::trial::Operator;
use haptic_lab::drawing::{Chart, Observation, Page, Table, Trace};
use haptic_lab::stats::mean::share_interval;
use std::collections::BTreeSet;

/// Height of the smaller charts, px.
const SMALL_PX: f64 = 220.0;
/// Points of a curve.
const CURVE: usize = 200;
/// Distance between two resistances of one condition, as a share of the difficulties' extent: their bars stand beside
/// one another.
const BESIDE: f64 = 0.007;
/// Room beside the outermost levels, as a share of their extent.
const MARGIN: f64 = 0.06;

/// The charts of a targeting task, by the name of the picture that holds them.
pub(super) fn fitts_charts(analysis: &FittsAnalysis, trajectories: &[Trajectory]) -> Vec<(&'static str, Vec<Chart>)> {
    let resistances = analysis.comparisons.first().map(|comparison| &comparison.resistances);
    let quadrants = |what, across, least, of: fn(&Difference) -> Option<[f64; 2]>| {
        let resistances = resistances.into_iter().flatten();
        let differences = &analysis.differences;
        resistances
            .filter_map(|resistance| quadrant((differences, resistance, least), what, across, of))
            .collect()
    };
    let charts = vec![
        ("difficulty", vec![difficulty(analysis)]),
        (
            "quadrants-errors",
            // So far that the axis counts by whole errors.
            quadrants("errors", "Errors less baseline", 2.5, |one| {
                Some([one.errors, one.time_s])
            }),
        ),
        (
            "quadrants-size",
            quadrants("size", "Error size less baseline (mm)", 1.0, |one| {
                Some([1e3 * one.error_size_m?, one.time_s])
            }),
        ),
        ("trajectories", courses(trajectories)),
    ];
    marked(charts, analysis.operator)
}

/// Says on each chart that a model did the trials, if so: a figure is copied without the notes of the analysis.
fn marked(mut charts: Vec<(&'static str, Vec<Chart>)>, operator: Option<Operator>) -> Vec<(&'static str, Vec<Chart>)> {
    if operator == Some(Operator::Simulated) {
        for chart in charts.iter_mut().flat_map(|(_, charts)| charts) {
            chart.notes.insert(0, format!("A {SIMULATED}"));
        }
    }
    charts
}

/// The charts of a perception test, by the name of the picture that holds them.
pub(super) fn perception_charts(analysis: &PerceptionAnalysis) -> Vec<(&'static str, Vec<Chart>)> {
    let charts = analysis.cases.iter().map(psychometric).collect();
    marked(vec![("psychometric", charts)], analysis.operator)
}

/// The page of an analysis.
pub(super) fn page(
    title: &str,
    charts: Vec<Chart>,
    tables: &[(String, Table)],
    refused: &[Refusal],
    notes: &[String],
) -> Page {
    let refused = refused
        .iter()
        .map(|one| format!("Not found: {}: {}", one.what, one.why));
    Page {
        title: title.to_owned(),
        paragraphs: notes.iter().cloned().chain(refused).collect(),
        charts,
        tables: tables.iter().map(|(_, table)| table.clone()).collect(),
    }
}

/// Means by condition, and the lines through them.
fn difficulty(analysis: &FittsAnalysis) -> Chart {
    let points = || analysis.difficulty.iter().flat_map(|one| &one.points);
    let counts = points().map(|point| point.movements);
    let mut chart = Chart::new(
        format!("Movement time against difficulty, {}", sizes(counts, "movements")),
        "Index of difficulty (bit)",
        "Movement time (s)",
    );
    if analysis.difficulty.len() > 1 {
        let note = "Points of one difficulty stand side by side about its place";
        chart.notes.push(note.to_owned());
    }
    let difficulties = points().map(|point| point.difficulty_bit);
    let extent_bit = difficulties.clone().fold(f64::MIN, f64::max) - difficulties.fold(f64::MAX, f64::min);
    let beside_bit =
        |place: usize| (place as f64 - 0.5 * (analysis.difficulty.len() as f64 - 1.0)) * BESIDE * extent_bit;
    for (colour, one) in analysis.difficulty.iter().enumerate() {
        let points = one.points.iter().map(|point| Observation {
            at: [point.difficulty_bit + beside_bit(colour), point.movement_time_s],
            bar: point.movement_time_interval_s,
            count: u32::try_from(point.movements).unwrap_or(u32::MAX),
        });
        let points: Vec<Observation> = points.collect();
        let ends = one
            .line
            .zip(one.points.first().zip(one.points.last()))
            .map(|(line, (first, last))| {
                [first, last]
                    .map(|point| point.difficulty_bit)
                    .map(|difficulty| [difficulty, line.intercept + line.slope * difficulty])
            });
        chart = chart.with(Trace::discs(one.resistance.as_str(), &points).in_colour(colour));
        if let Some(ends) = ends {
            chart = chart.with(Trace::line("", ends.to_vec()).in_colour(colour));
        }
        let refused = one.refused.iter();
        chart
            .notes
            .extend(refused.map(|why| format!("{} has no line: {why}", one.resistance)));
    }
    chart
}

/// What the area of a disc says, by the least and the greatest number.
fn sizes(counts: impl Iterator<Item = usize> + Clone, of: &str) -> String {
    let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    if least == most {
        return format!("n = {most} {of}");
    }
    format!("area: {least} to {most} {of}")
}

/// Difference in time against another: a disc for each subject and condition. Left and below are better. The horizontal axis goes at least so far.
fn quadrant(
    (differences, resistance, least): (&[Difference], &str, f64),
    what: &str,
    across: &str,
    of: impl Fn(&Difference) -> Option<[f64; 2]>,
) -> Option<Chart> {
    let own = differences.iter().filter(|one| one.resistance == resistance);
    let points: Vec<Observation> = own
        .filter_map(of)
        .map(|at| Observation {
            at,
            bar: None,
            count: 1,
        })
        .collect();
    let reach = |axis: usize, least| points.iter().map(|point| point.at[axis].abs()).fold(least, f64::max) * 1.1;
    let (x, y) = (reach(0, least), reach(1, 1.0));
    let axes = vec![[-x, 0.0], [x, 0.0], [f64::NAN, f64::NAN], [0.0, -y], [0.0, y]];
    let mut chart = Chart::new(
        format!("{resistance}: time against {what}"),
        across,
        "Time less baseline (s)",
    )
    .with(Trace::dashed("", axes).in_colour(4))
    .with(Trace::discs("", &points).in_colour(0));
    (chart.across.range, chart.up.range) = (Some((-x, x)), Some((-y, y)));
    chart.height_px = SMALL_PX;
    (!points.is_empty()).then_some(chart)
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
                "Travel of the handle (mm)",
            );
            own.fold(chart, |chart, one| {
                let points = one
                    .points
                    .iter()
                    .map(|[t_s, travel_m]| [*t_s, 1e3 * travel_m])
                    .collect();
                chart.with(Trace::line(one.resistance.as_str(), points))
            })
        })
        .collect()
}

/// The shares of correct answers, and the function through them, or why there is none.
fn psychometric(case: &CaseAnalysis) -> Chart {
    let levels = &case.pooled.levels;
    let shares = levels.iter().map(|level| Observation {
        at: [level.level, f64::from(level.correct) / f64::from(level.trials)],
        bar: Some(share_interval(level.correct, level.trials)),
        count: level.trials,
    });
    let shares: Vec<Observation> = shares.collect();
    let subjects = match case.subjects.len() {
        1 => "1 subject".to_owned(),
        count => format!("{count} subjects"),
    };
    let counts = levels.iter().map(|level| level.trials as usize);
    let mut chart = Chart::new(
        format!("Case {:?}, {}, {subjects}", case.case, case.method.name()),
        "Change of friction (N)",
        "Share of correct answers",
    )
    .with(Trace::discs(sizes(counts, "answers"), &shares));
    let ends = levels.first().zip(levels.last());
    if let Some((fit, (first, last))) = case.pooled.fit.zip(ends) {
        let curve = (0..=CURVE)
            .map(|place| first.level + (last.level - first.level) * place as f64 / CURVE as f64)
            .map(|level| [level, fit.probability(level)])
            .collect();
        let share = fit.probability(fit.threshold);
        let digits = decimals(fit.threshold, 3);
        let threshold = format!("threshold {:.digits$} N", fit.threshold);
        chart = chart.with(Trace::line("fitted", curve)).with(Trace::dashed(
            threshold,
            vec![[fit.threshold, 0.0], [fit.threshold, share]],
        ));
        if let Some(found) = &case.pooled.intervals {
            let interval = found.threshold_interval.map(|end| [end, share]).to_vec();
            chart = chart.with(Trace::line("its 95 %", interval).in_colour(2));
        }
    }
    let refused = case.pooled.refused.iter();
    chart.notes.extend(refused.map(|why| format!("Not fitted: {why}")));
    let extent = ends.map(|(first, last)| (first.level, last.level, last.level - first.level));
    let extent = extent.filter(|(.., extent)| *extent > 0.0);
    let interval = case.pooled.intervals.as_ref().map(|found| found.threshold_interval);
    chart.across.range = extent.map(|(first, last, extent)| {
        // The end of an interval is seen; one that is wider than the levels is cut.
        let [low, high] = interval.unwrap_or([first, last]);
        let (low, high) = (low.clamp(0.0, first.max(0.0)), high.clamp(last, last + extent));
        (low - MARGIN * extent, high + MARGIN * extent)
    });
    let lowest = shares.iter().filter_map(|one| one.bar).map(|[low, _]| low);
    chart.up.range = Some((lowest.fold(0.4, f64::min) - 0.02, 1.02));
    chart
}
