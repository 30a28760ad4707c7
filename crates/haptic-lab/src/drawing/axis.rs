//! What an axis spans, and where its numbers stand.

/// Numbers that an axis has at least, about; fewer where it is short.
const MARKS: f64 = 5.0;
/// Room beyond the outermost points, as a share of their extent.
const MARGIN: f64 = 0.04;

/// An axis and the pixels that it lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    /// Pixels of both ends.
    ends_px: (f64, f64),
}

impl Scale {
    /// The scale of an axis of a range, or with such values on it.
    pub(super) fn new(range: Option<(f64, f64)>, values: impl Iterator<Item = f64>, ends_px: (f64, f64)) -> Self {
        let (low, high) = range.unwrap_or_else(|| extent(values));
        Self { low, high, ends_px }
    }

    /// The pixel of a value.
    pub(super) fn px(&self, value: f64) -> f64 {
        let (first, last) = self.ends_px;
        first + (last - first) * (value - self.low) / (self.high - self.low)
    }

    /// The numbers that stand at the axis: 1, 2 or 5 times a power of ten apart. Each needs so much room, px. Values
    /// that are decimal logarithms stand there as powers of ten.
    pub(super) fn marks(&self, room_px: f64, are_decades: bool) -> Vec<(f64, String)> {
        // The steps make up to two and a half times as many.
        let most = 0.4 * (self.ends_px.1 - self.ends_px.0).abs() / room_px;
        let rough = ((self.high - self.low) / most.clamp(1.0, MARKS)).max(if are_decades { 1.0 } else { 0.0 });
        let power = 10_f64.powf(rough.log10().floor());
        let step = [5.0, 2.0, 1.0]
            .map(|factor| factor * power)
            .into_iter()
            .find(|step| *step <= rough)
            .unwrap_or(power);
        let (first, last, decimals) = (
            (self.low / step).ceil() as i64,
            (self.high / step).floor() as i64,
            -power.log10().floor() as i64,
        );
        (first..=last)
            .map(|index| {
                let value = index as f64 * step;
                let text = number(value, decimals);
                (value, if are_decades { format!("1e{text}") } else { text })
            })
            .collect()
    }
}

/// The extent of values, with a margin. Values that are not finite do not count.
fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = haptic_motion::median::extent(values.filter(|value| value.is_finite()));
    if low > high {
        return (0.0, 1.0);
    }
    // A single value gets an extent of its own size.
    let margin = match high - low {
        extent if extent > 1e-12 * high.abs().max(low.abs()) => MARGIN * extent,
        _ => (0.1 * high.abs()).max(1e-12),
    };
    (low - margin, high + margin)
}

fn number(value: f64, decimals: i64) -> String {
    match usize::try_from(decimals) {
        Ok(decimals) if decimals <= 5 => format!("{value:.decimals$}"),
        Ok(_) => format!("{value:e}"),
        Err(_) if value.abs() >= 1e6 => format!("{value:e}"),
        Err(_) => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(values: &[f64]) -> Scale {
        Scale::new(None, values.iter().copied(), (0.0, 100.0))
    }

    #[test]
    fn marks_are_round_and_within_the_axis() {
        for (values, expected) in [
            (&[0.0, 10.0][..], &["0", "2", "4", "6", "8", "10"][..]),
            (&[-0.25, 0.25], &["-0.2", "-0.1", "0.0", "0.1", "0.2"]),
            (
                &[0.0, 0.0004],
                &[
                    "0.00000", "0.00005", "0.00010", "0.00015", "0.00020", "0.00025", "0.00030", "0.00035", "0.00040",
                ],
            ),
            (
                &[20_000.0, 30_000.0],
                &["20000", "22000", "24000", "26000", "28000", "30000"],
            ),
        ] {
            let marks: Vec<String> = scale(values)
                .marks(1.0, false)
                .into_iter()
                .map(|(_, text)| text)
                .collect();
            assert_eq!(marks, expected);
        }
        let powers = scale(&[-1.0, 3.0]).marks(1.0, true);
        assert_eq!(
            powers.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>(),
            ["1e-1", "1e0", "1e1", "1e2", "1e3"]
        );
    }

    #[test]
    fn nothing_one_value_and_no_number_have_an_extent_too() {
        assert_eq!(extent([].into_iter()), (0.0, 1.0));
        assert_eq!(extent([f64::NAN].into_iter()), (0.0, 1.0));
        for value in [0.0, -3.0, 1e9] {
            let (low, high) = extent([value, f64::INFINITY].into_iter());
            assert!(low < value && value < high && high.is_finite(), "{low} {high}");
            assert!((scale(&[value]).px(value) - 50.0).abs() < 1e-6);
            assert!(!scale(&[value]).marks(1.0, false).is_empty());
        }
    }
}
