//! A chart of data and fit, thinned: an hour of samples has more dots than the window has pixels.

use crate::tape::outline::{BREAK, Span, outlines};
use haptic_lab::drawing::{Chart, Form};

/// Cells across and up in which one dot is kept: some ten to each dot that a window can show, for the zoom.
const KEPT_CELLS: [usize; 2] = [1600, 800];

/// Columns of a line, of which the least and the greatest value are kept.
const KEPT_COLUMNS: f64 = 4000.0;

/// Share of the extent that is left free at either end.
const MARGIN: f64 = 0.05;

/// A chart of data and fit, with the extent of its points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FitChart {
    pub(crate) chart: Chart,
    pub(crate) extent: Extent,
}

/// A rectangle in the units of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    pub(crate) least: [f64; 2],
    pub(crate) greatest: [f64; 2],
}

impl FitChart {
    pub(super) fn new(mut chart: Chart) -> Self {
        let extent = Extent::of(chart.traces.iter().flat_map(|trace| &trace.points).copied());
        for trace in &mut chart.traces {
            trace.points = if trace.form == Form::Dots {
                thinned(trace.points.iter().copied(), extent, KEPT_CELLS)
            } else {
                let parts: Vec<_> = parts(&trace.points).map(outlined).collect();
                parts.join(&BREAK)
            };
        }
        Self { chart, extent }
    }
}

/// The parts of a line between its breaks.
pub(crate) fn parts(line: &[[f64; 2]]) -> impl Iterator<Item = &[[f64; 2]]> {
    line.split(|point| !is_finite(point)).filter(|part| !part.is_empty())
}

impl Extent {
    /// Of all points that are finite, with a margin.
    fn of(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points.filter(is_finite) {
            for axis in 0..2 {
                least[axis] = least[axis].min(point[axis]);
                greatest[axis] = greatest[axis].max(point[axis]);
            }
        }
        for axis in 0..2 {
            if least[axis] > greatest[axis] {
                (least[axis], greatest[axis]) = (-1.0, 1.0);
            }
            // A line that is level has an extent too.
            let margin = (MARGIN * (greatest[axis] - least[axis])).max(1e-9);
            least[axis] -= margin;
            greatest[axis] += margin;
        }
        Self { least, greatest }
    }
}

fn is_finite(point: &[f64; 2]) -> bool {
    point.iter().all(|value| value.is_finite())
}

/// The first point in each of `cells` cells of a rectangle; points outside of it are left out.
pub(crate) fn thinned(points: impl Iterator<Item = [f64; 2]>, within: Extent, cells: [usize; 2]) -> Vec<[f64; 2]> {
    let [columns, rows] = cells.map(|count| count.max(1));
    let mut is_taken = vec![false; columns * rows];
    let place = |point: &[f64; 2], axis: usize, count: usize| {
        let share = (point[axis] - within.least[axis]) / (within.greatest[axis] - within.least[axis]);
        // Not a number is in no cell.
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of a few thousand cells"
        )]
        let place = (0.0..=1.0)
            .contains(&share)
            .then(|| ((share * count as f64) as usize).min(count - 1));
        place
    };
    let mut kept = Vec::new();
    for point in points {
        let (Some(column), Some(row)) = (place(&point, 0, columns), place(&point, 1, rows)) else {
            continue;
        };
        let cell = &mut is_taken[row * columns + column];
        if !*cell {
            *cell = true;
            kept.push(point);
        }
    }
    kept
}

/// A line with the least and the greatest value of each column. A line that goes back is left as it is.
fn outlined(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let is_long = line.len() as f64 > 2.0 * KEPT_COLUMNS;
    if !is_long || !line.is_sorted_by(|a, b| a[0] <= b[0]) {
        return line.to_vec();
    }
    let column = ((line[line.len() - 1][0] - line[0][0]) / KEPT_COLUMNS).max(f64::MIN_POSITIVE);
    let spans = line.iter().enumerate().map(|(index, [x, y])| Span {
        first_s: *x,
        follows_gap: false,
        what: (*y, index),
    });
    outlines(spans, 1, |span, _| [*span; 2], column, |index| line[index][0])
        .pop()
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_lab::drawing::Trace;

    /// An hour at 1 kHz.
    const HOUR: u32 = 3_600_000;

    #[test]
    fn an_hour_of_dots_and_lines_is_thinned_and_keeps_its_extremes() {
        let time = |tick: u32| f64::from(tick) * 1e-3;
        let count = test_run::extent(HOUR / 20, HOUR);
        let circle = (0..count).map(|tick| {
            let noise = f64::from(tick.wrapping_mul(2_654_435_761) >> 16) / 65536.0;
            [(6.0 * time(tick)).sin(), (6.0 * time(tick)).cos() + 0.2 * noise]
        });
        let spike = [0.5, 9.0];
        let line = (0..count).map(|tick| [time(tick), if tick == 77_777 { 5.0 } else { 0.0 }]);
        let chart = Chart::new("Force", "Velocity (m/s)", "Force (N)")
            .with(Trace::dots("measured", circle.chain([spike]).collect()))
            .with(Trace::line("residual", line.collect()));
        let FitChart { chart, extent } = FitChart::new(chart);
        let [dots, line] = &chart.traces[..] else {
            panic!("{:?}", chart.traces.len())
        };
        let (dots, line) = (&dots.points, &line.points);
        assert!(dots.contains(&spike) && dots.len() < 200_000, "{}", dots.len());
        assert!(line.contains(&[77.777, 5.0]) && line.len() < 9000);
        assert!(extent.greatest[1] > 9.0);
        // What is seen of a part of it is what lies there.
        let part = Extent {
            least: [0.0, 8.0],
            greatest: [1.0, 10.0],
        };
        assert_eq!(thinned(dots.iter().copied(), part, [10, 10]), [spike]);
    }

    #[test]
    fn a_line_that_is_interrupted_stays_so() {
        let points = vec![[0.0, 1.0], [1.0, 1.0], [f64::NAN; 2], [2.0, 3.0]];
        let chart = Chart::new("a", "b", "c").with(Trace::line("law", points));
        let thin = FitChart::new(chart);
        let parts: Vec<_> = parts(&thin.chart.traces[0].points).collect();
        assert_eq!(parts, [&[[0.0, 1.0], [1.0, 1.0]][..], &[[2.0, 3.0]]]);
    }
}
