//! Points in pixels as SVG: lines, dots, and discs with error bars, whose area grows evenly with their observations.

use std::collections::HashSet;
use std::fmt::Write as _;

/// A dot for each place that has one: many samples fall on one. A dot is 3 px wide, so that places 2 px
/// apart leave no gap.
pub(super) fn dots(points: &[[f64; 2]]) -> String {
    let mut seen = HashSet::new();
    let mut path = String::new();
    for [x, y] in points.iter().filter(|point| is_drawable(point)) {
        let place = (2 * (0.5 * x).round() as i64, 2 * (0.5 * y).round() as i64);
        if seen.insert(place) {
            write!(path, "M{} {}h0", place.0, place.1).unwrap_or(());
        }
    }
    path
}

/// Lines, interrupted at points that are not finite.
pub(super) fn lines(points: &[[f64; 2]]) -> String {
    let mut path = String::new();
    for part in points.split(|point| !is_drawable(point)) {
        for (index, [x, y]) in decimated(part).into_iter().enumerate() {
            let step = if index == 0 { 'M' } else { 'L' };
            write!(path, "{step}{x:.1} {y:.1}").unwrap_or(());
        }
    }
    path
}

/// A number that programs for images can take.
pub(super) fn is_drawable([x, y]: &[f64; 2]) -> bool {
    x.abs() <= 1e6 && y.abs() <= 1e6
}

/// The points that a drawing shows. Where a line only runs to the right, these are the first, the
/// lowest, the highest and the last of each column of pixels; elsewhere, those half a pixel apart.
fn decimated(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let goes_right = points.windows(2).all(|pair| pair[1][0] >= pair[0][0]);
    let mut kept: Vec<[f64; 2]> = Vec::new();
    if goes_right {
        for column in points.chunk_by(|a, b| a[0].floor() == b[0].floor()) {
            let by_height = |&a: &usize, &b: &usize| column[a][1].total_cmp(&column[b][1]);
            let extremes = [(0..column.len()).min_by(by_height), (0..column.len()).max_by(by_height)];
            let mut wanted: Vec<usize> = extremes.into_iter().flatten().chain([0, column.len() - 1]).collect();
            wanted.sort_unstable();
            wanted.dedup();
            kept.extend(wanted.into_iter().map(|index| column[index]));
        }
    } else {
        for (index, point) in points.iter().enumerate() {
            let is_apart = kept
                .last()
                .is_none_or(|last| (point[0] - last[0]).hypot(point[1] - last[1]) >= 0.5);
            if is_apart || index + 1 == points.len() {
                kept.push(*point);
            }
        }
    }
    kept
}

/// Radius of a disc without an observation, and of the one with the most of its chart, px.
const RADII: [f64; 2] = [2.0, 6.0];
/// Observations that a chart's largest disc stands for at least: a single one is a small disc.
const MIN_OF_LARGEST: u32 = 5;
/// Half the width of an error bar's ends, px.
const CAP: f64 = 4.0;

/// Radius of a disc that stands for `count` observations, where the chart has one of `most`, px.
fn radius(count: u32, most: u32) -> f64 {
    let share = f64::from(count) / f64::from(most.max(MIN_OF_LARGEST));
    let [least, greatest] = RADII.map(|radius| radius * radius);
    (least + (greatest - least) * share).sqrt()
}

/// Discs at points, px, below each its error bar.
pub(super) fn discs(
    points: &[[f64; 2]],
    bars: &[Option<[f64; 2]>],
    (counts, most): (&[u32], u32),
    class: &str,
) -> String {
    let colour = class.rsplit(' ').next().unwrap_or_default();
    let mut drawn = String::new();
    let observations = points.iter().zip(bars).zip(counts);
    for (([x, y], bar), count) in observations.filter(|((point, _), _)| is_drawable(point)) {
        // A string takes whatever is written to it.
        if let Some([from, to]) = bar.filter(is_drawable) {
            let (left, width) = (x - CAP, 2.0 * CAP);
            write!(
                drawn,
                "<path class=\"bar {colour}\" d=\"M{x:.1} {from:.1}V{to:.1}M{left:.1} {from:.1}h{width}M{left:.1} {to:.1}h{width}\"/>"
            )
            .unwrap_or(());
        }
        let radius = radius(*count, most);
        write!(
            drawn,
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.2}\"/>"
        )
        .unwrap_or(());
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_interrupted_where_a_value_is_missing() {
        let text = lines(&[[0.0, 0.0], [1.0, 1.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 0.0]]);
        assert_eq!(text, "M0.0 0.0L1.0 1.0M3.0 1.0L4.0 0.0");
    }

    #[test]
    fn a_long_line_keeps_its_spikes_and_little_else() {
        let mut points: Vec<[f64; 2]> = (0..100_000).map(|k| [f64::from(k) * 7e-3, f64::from(k % 7)]).collect();
        points[54_321][1] = 250.0;
        let kept = decimated(&points);
        assert!(kept.len() < 2900, "{}", kept.len());
        assert!(kept.iter().any(|point| point[1] == 250.0));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[99_999]));
        let round: Vec<[f64; 2]> = (0..100_000)
            .map(|k| [100.0 * f64::from(k).cos(), 100.0 * f64::from(k).sin()])
            .collect();
        let slow: Vec<[f64; 2]> = (0..100_000)
            .map(|k| [100.0 * (f64::from(k) * 1e-4).cos(), 100.0 * (f64::from(k) * 1e-4).sin()])
            .collect();
        assert!(decimated(&slow).len() < 2100, "{}", decimated(&slow).len());
        assert!(dots(&round).matches('M').count() < 450);
    }

    #[test]
    fn a_discs_area_grows_evenly_with_its_observations() {
        let areas: Vec<f64> = (0..=40).map(|count| radius(count, 40).powi(2)).collect();
        let steps: Vec<f64> = areas.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(
            steps.iter().all(|step| *step > 0.0 && (step - steps[0]).abs() < 1e-9),
            "{steps:?}"
        );
        assert_eq!((radius(0, 40), radius(40, 40)), (RADII[0], RADII[1]));
    }

    #[test]
    fn a_disc_has_its_bar_and_stays_without_one() {
        let points = [[10.0, 20.0], [30.0, 20.0], [f64::NAN, 1.0]];
        let drawn = discs(&points, &[Some([25.0, 15.0]), None, None], (&[20, 1, 1], 20), "disc t2");
        assert_eq!(drawn.matches("<circle class=\"disc t2\"").count(), 2);
        assert_eq!(
            drawn
                .matches("<path class=\"bar t2\" d=\"M10.0 25.0V15.0M6.0 25.0h8")
                .count(),
            1
        );
        assert!(drawn.contains("r=\"6.00\"") && !drawn.contains("NaN"), "{drawn}");
    }
}
