//! The slides of both records over one another, for people.

use super::{AlignedBy, Comparison, Level};
use crate::drawing::{Chart, Page, Table, Trace};
use crate::identify::decimals;
use haptic_motion::median::extent;
use std::collections::HashSet;

/// Cells of a plot along each axis, of each of which the rendered record has one dot: they lie above those of the real
/// one and must not hide them, and a fast slip is seen as well as a rest.
const CELLS: f64 = 60.0;

/// The page of a comparison: force against velocity and against position, force over time where the
/// motions are the same, and what is left below; and the levels. `names` are those of the records.
#[must_use]
pub fn page(comparison: &Comparison, names: [&str; 2]) -> Page {
    let force = match comparison.mass_kg {
        Some(mass) => format!("Force less inertia of {mass:.3} kg (N)"),
        None => "Force (N)".to_owned(),
    };
    let curves = &comparison.curves;
    let against = |title: &str, across: &str, place: usize| {
        let points = |course: &[[f64; 3]]| course.iter().map(|row| [row[place], row[2]]).collect();
        Chart::new(title, across, force.as_str())
            .with(Trace::dots("real", points(&curves.real)))
            .with(Trace::dots("rendered", one_a_cell(points(&curves.rendered))))
    };
    let mut charts = vec![
        against("Force against velocity", "Velocity (m/s)", 0),
        against("Force against position", "Position (m)", 1),
    ];
    let left = Trace::line("rendered - real", curves.difference.clone());
    let residual = match comparison.aligned_by {
        AlignedBy::Time => {
            let over_time = |course: &[[f64; 3]]| {
                let times = curves.difference.iter().map(|point| point[0]);
                times.zip(course).map(|(t, row)| [t, row[2]]).collect()
            };
            charts.push(
                Chart::new("Force over time", "Time (s)", force.as_str())
                    .with(Trace::line("real", over_time(&curves.real)))
                    .with(Trace::dashed("rendered", over_time(&curves.rendered))),
            );
            Chart::new("Difference", "Time (s)", "Force (N)").with(left)
        }
        AlignedBy::Velocity => Chart::new("Difference", "Velocity (m/s)", "Force (N)").with(left),
    };
    charts.push(Chart {
        height_px: 150.0,
        ..residual
    });
    Page {
        title: format!("{} and {}", names[0], names[1]),
        paragraphs: std::iter::once(summary(comparison))
            .chain(comparison.notes.iter().cloned())
            .collect(),
        charts,
        tables: vec![table(comparison)],
    }
}

/// The first point of each cell.
fn one_a_cell(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let size = [0, 1].map(|axis| {
        let (low, high) = extent(points.iter().map(|point| point[axis]));
        ((high - low) / CELLS).max(f64::MIN_POSITIVE)
    });
    let mut seen = HashSet::new();
    // The cast saturates.
    points.retain(|point| seen.insert([0, 1].map(|axis| (point[axis] / size[axis]).floor() as i64)));
    points
}

/// What is compared, and how far the forces are apart, in a sentence.
#[must_use]
pub fn summary(comparison: &Comparison) -> String {
    let Comparison {
        overlap_s,
        force_rms_difference_n: rms,
        force_peak_difference_n: peak,
        force_rms_n: size,
        ..
    } = comparison;
    let aligned = match comparison.shift_s {
        Some(shift) => {
            let known = comparison
                .intervals
                .get("shift_s")
                .map(|ends| ends.map(|end_s| end_s * 1e3));
            let shift_ms = shift * 1e3;
            let digits = decimals(shift_ms, known.as_ref());
            let interval = known.map_or_else(String::new, |[low, high]| {
                format!(" (95 % interval {low:.digits$} to {high:.digits$} ms)")
            });
            format!("Aligned by time, shifted by {shift_ms:.digits$} ms{interval}, over {overlap_s:.1} s")
        }
        None => "Aligned by velocity".to_owned(),
    };
    format!(
        "{aligned}: the forces differ by {rms:.3} N rms and {peak:.3} N at most; the real force is {size:.3} N rms."
    )
}

/// The levels of both, and their differences.
#[must_use]
pub fn table(comparison: &Comparison) -> Table {
    let head = [
        "level",
        "direction",
        "real, N",
        "rendered, N",
        "difference, N",
        "difference, %",
        "count",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (name, levels) in [
        ("sliding", comparison.sliding_force_n),
        ("breakaway", comparison.breakaway_force_n),
    ] {
        for (direction, level) in [("positive", levels.positive), ("negative", levels.negative)] {
            let Some(Level {
                real_n,
                rendered_n,
                difference_n,
                difference_percent,
                count,
            }) = level
            else {
                continue;
            };
            rows.push(vec![
                name.to_owned(),
                direction.to_owned(),
                format!("{real_n:.3}"),
                format!("{rendered_n:.3}"),
                format!("{difference_n:+.3}"),
                format!("{difference_percent:+.1}"),
                count.to_string(),
            ]);
        }
    }
    Table {
        caption: "Levels by direction".to_owned(),
        rows,
    }
}
