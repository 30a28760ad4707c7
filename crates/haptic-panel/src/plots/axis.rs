//! The lines of an axis, the numbers at it, and its range.

use egui_plot::GridMark;

/// Width of the numbers of the vertical axes, points: the same for all, so that the plots are aligned.
pub(crate) const AXIS_WIDTH: f32 = 64.0;

/// Usual number of numbers at an axis.
pub(crate) const DEFAULT_COUNT: f64 = 4.0;

/// Distance of the numbers at a vertical axis, points.
const NUMBER_DISTANCE: f32 = 40.0;

/// Number of numbers at a vertical axis of this height, points.
pub(crate) fn count_for(height: f32) -> f64 {
    f64::from((height / NUMBER_DISTANCE).clamp(2.0, 8.0))
}

/// Share of the axis that is left free at either end.
const MARGIN: f64 = 0.08;

/// The range of an axis that shows all values and spans at least `smallest_span`.
pub(crate) fn reach(values: impl IntoIterator<Item = f64>, smallest_span: f64) -> (f64, f64) {
    let (low, high) = values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    let half = ((high - low) / 2.0 * (1.0 + 2.0 * MARGIN)).max(smallest_span / 2.0);
    let middle = low.midpoint(high);
    (middle - half, middle + half)
}

/// Round distances, and the number of parts into which finer lines divide them.
const ROUND: [(f64, f64); 4] = [(10.0, 5.0), (5.0, 5.0), (2.0, 4.0), (1.0, 5.0)];

/// The next of them.
const FINEST: (f64, f64) = (0.5, 5.0);

/// Distances of the grid's lines: about `count` with a number, at 1, 2 or 5 times a power of ten.
///
/// The plot's own grid knows only powers of ten, which leaves most axes with the number 0 alone.
pub(crate) fn steps((low, high): (f64, f64), count: f64) -> [f64; 3] {
    let wanted = (high - low) / count;
    if !(wanted.is_finite() && wanted > f64::MIN_POSITIVE) {
        return [1.0; 3];
    }
    let power = 10_f64.powf(wanted.log10().floor());
    let nearest = match wanted / power {
        ..1.5 => 3,
        ..3.5 => 2,
        ..7.5 => 1,
        _ => 0,
    };
    // Two lines lie on the axis wherever it begins; a rounding error must not remove one.
    let fits = |(round, _): &(f64, f64)| 2.0 * round * power <= (high - low) * (1.0 - 1e-9);
    let (round, parts) = ROUND[nearest..].iter().copied().find(fits).unwrap_or(FINEST);
    let major = round * power;
    [major / parts, major, major * 10.0]
}

/// The lines of an axis, both ends included: egui's own grid has none at the right end, where the newest sample is.
pub(crate) fn grid((low, high): (f64, f64), count: f64) -> Vec<GridMark> {
    let distances = steps((low, high), count);
    let [finest, ..] = distances;
    // A rounding error must not remove a line at an end.
    let (first, last) = ((low / finest - 1e-6).ceil(), (high / finest + 1e-6).floor());
    if !(first.is_finite() && last.is_finite()) {
        return Vec::new();
    }
    let is_multiple = |value: f64, step: f64| ((value / step).round() * step - value).abs() < 1e-6 * finest;
    // No more lines than a screen has pixels.
    (0..5000)
        .map(|line| (first + f64::from(line)) * finest)
        .take_while(|value| *value <= (last + 0.5) * finest)
        .map(|value| {
            let widest = distances.iter().rev().copied().find(|step| is_multiple(value, *step));
            let step_size = widest.unwrap_or(finest);
            GridMark {
                // What is a multiple of a wider distance is that to the last digit.
                value: (value / step_size).round() * step_size,
                step_size,
            }
        })
        .collect()
}

/// The places of an axis that have a number: at most twenty, also where a step is lost in rounding.
pub(crate) fn marks(bounds: (f64, f64), count: f64) -> impl Iterator<Item = f64> {
    let [_, step, _] = steps(bounds, count);
    let first = (bounds.0 / step).ceil();
    (0..20)
        .map(move |mark| (first + f64::from(mark)) * step)
        .take_while(move |mark| *mark <= bounds.1)
}

/// A number of an axis with this range, with as many digits as it needs.
pub(crate) fn number(value: f64, bounds: (f64, f64)) -> String {
    let [finest, ..] = steps(bounds, DEFAULT_COUNT);
    let text = format!("{value:.*}", decimals(finest));
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    // No "-0".
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Decimals that numbers at this distance need.
fn decimals(step: f64) -> usize {
    // Rounding errors must not turn the 1 of a power of ten into 0.999.
    let decimals = (-step.log10() - 1e-6).ceil().clamp(0.0, 12.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=12"
    )]
    let decimals = decimals as usize;
    decimals
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_numbers_of_an_axis_are_round_and_enough() {
        for (bounds, major, digits) in [((-4.5, 4.5), 2.0, 0), ((0.0, 1.0), 0.2, 1), ((-23.0, 24.0), 10.0, 0)] {
            let [minor, step, _] = steps(bounds, DEFAULT_COUNT);
            assert!((step - major).abs() < 1e-9, "{bounds:?}: {step}");
            assert!(minor < step);
            assert_eq!(decimals(step), digits, "{bounds:?}");
        }
        assert_eq!(steps((f64::NEG_INFINITY, f64::INFINITY), DEFAULT_COUNT), [1.0; 3]);
        for (value, text) in [(-0.0, "0"), (3.5, "3.5"), (0.1 + 0.2, "0.3"), (20.0, "20")] {
            assert_eq!(number(value, (0.0, 4.0)), text);
        }
    }

    proptest! {
        /// A single number does not show the range of an axis, and neither do two equal ones.
        #[test]
        fn an_axis_has_two_numbers_at_least(
            middle in -1e4..1e4_f64,
            decades in -4.0..5.0_f64,
            is_centred: bool,
            count in prop_oneof![Just(2.0), Just(DEFAULT_COUNT), 2.0..8.0_f64],
        ) {
            let half = 10_f64.powf(decades);
            let middle = if is_centred { 0.0 } else { middle };
            let bounds = (middle - half, middle + half);
            let texts: Vec<_> = marks(bounds, count).map(|mark| number(mark, bounds)).collect();
            let different: std::collections::BTreeSet<_> = texts.iter().collect();
            prop_assert!((2..=16).contains(&texts.len()) && different.len() == texts.len(), "{bounds:?}: {texts:?}");
        }
    }

    #[test]
    fn axis_has_lines_at_both_ends_and_wider_numbered_ones() {
        let numbered = |bounds| -> Vec<f64> {
            let lines = grid(bounds, DEFAULT_COUNT).into_iter();
            lines
                .filter(|line| line.step_size >= steps(bounds, DEFAULT_COUNT)[1])
                .map(|line| line.value)
                .collect()
        };
        assert_eq!(numbered((-5.0, 0.0)), [-5.0, -4.0, -3.0, -2.0, -1.0, 0.0]);
        assert_eq!(numbered((-4.5, 4.5)), [-4.0, -2.0, 0.0, 2.0, 4.0]);
        assert_eq!(grid((-5.0, 0.0), DEFAULT_COUNT).len(), 26);
        assert!(grid((f64::NEG_INFINITY, f64::INFINITY), DEFAULT_COUNT).is_empty());
    }

    #[test]
    fn axis_reaches_beyond_values_and_keeps_minimum_span() {
        assert_eq!(reach([], 2.0), (-1.0, 1.0));
        assert_eq!(reach([5.0, 5.1], 2.0), (4.05, 6.05));
        let (low, high) = reach([-10.0, 10.0], 2.0);
        assert!((low + 11.6).abs() < 1e-9 && (high - 11.6).abs() < 1e-9);
    }
}
