//! Discs with error bars: a disc's area grows evenly with the number of its observations.

use super::paths::is_drawable;
use std::fmt::Write as _;

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
