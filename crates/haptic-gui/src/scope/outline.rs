//! Many samples in few points: of each column of pixels the least and the greatest value, in the order of time.
//!
//! Columns begin at multiples of their width on the daemon's clock and not at the edge of the plot, so that a line that
//! scrolls by does not shimmer. A spike of a single sample is the extreme of its column, so it is drawn at any zoom.

/// Points of lines through samples `(time, values)` in the order of time, with columns `column_s` wide. All lines are made in one
/// pass: a minute of samples is more than the processor's cache holds.
pub(crate) fn outlines<const N: usize>(
    samples: impl IntoIterator<Item = (f64, [f64; N])>,
    column_s: f64,
) -> [Vec<[f64; 2]>; N] {
    let mut lines = std::array::from_fn(|_| Vec::new());
    let mut columns: Option<[Column; N]> = None;
    let mut until_s = f64::NEG_INFINITY;
    for (t_s, values) in samples {
        match &mut columns {
            Some(columns) if t_s < until_s => {
                for (column, value) in columns.iter_mut().zip(values) {
                    column.take(t_s, value);
                }
            }
            _ => {
                // A division for each column and not for each sample: there may be a hundred in one.
                until_s = ((t_s / column_s).floor() + 1.0) * column_s;
                if let Some(whole) = columns.replace(values.map(|value| Column::new(t_s, value))) {
                    draw(whole, &mut lines);
                }
            }
        }
    }
    if let Some(last) = columns {
        draw(last, &mut lines);
    }
    lines
}

fn draw<const N: usize>(columns: [Column; N], lines: &mut [Vec<[f64; 2]>; N]) {
    for (column, line) in columns.into_iter().zip(lines) {
        column.draw(line);
    }
}

/// What falls into one column of pixels.
#[derive(Clone, Copy, Debug)]
struct Column {
    least: [f64; 2],
    greatest: [f64; 2],
}

impl Column {
    fn new(t_s: f64, value: f64) -> Self {
        Self {
            least: [t_s, value],
            greatest: [t_s, value],
        }
    }

    fn take(&mut self, t_s: f64, value: f64) {
        if value < self.least[1] {
            self.least = [t_s, value];
        }
        // The newer of two alike, so that a line at rest has both its ends.
        if value >= self.greatest[1] {
            self.greatest = [t_s, value];
        }
    }

    fn draw(self, points: &mut Vec<[f64; 2]>) {
        let (first, second) = if self.least[0] <= self.greatest[0] {
            (self.least, self.greatest)
        } else {
            (self.greatest, self.least)
        };
        points.push(first);
        if second != first {
            points.push(second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A single line.
    fn outline(samples: impl IntoIterator<Item = (f64, f64)>, column_s: f64) -> Vec<[f64; 2]> {
        let [line] = outlines(samples.into_iter().map(|(t_s, value)| (t_s, [value])), column_s);
        line
    }

    #[test]
    fn samples_fewer_than_columns_are_all_drawn() {
        let samples = [(0.0, 1.0), (1.0, 2.0), (2.0, 1.5)];
        let drawn = outline(samples, 0.5);
        assert_eq!(drawn, samples.map(|(t_s, value)| [t_s, value]));
    }

    proptest! {
        /// One sample that sticks out is drawn where it is, whatever the zoom.
        #[test]
        fn a_spike_of_one_sample_is_never_lost(
            noise in prop::collection::vec(-1.0..1.0f64, 1..2000),
            place in any::<prop::sample::Index>(),
            height in prop_oneof![2.0..50.0f64, -50.0..-2.0f64],
            start in 0.0..1e6f64,
            column_s in 1e-5..10.0f64,
        ) {
            let mut samples: Vec<_> = (0u32..).zip(&noise).map(|(i, value)| (start + f64::from(i) * 1e-3, *value)).collect();
            let spike = place.index(samples.len());
            samples[spike].1 = height;
            let drawn = outline(samples.iter().copied(), column_s);
            prop_assert!(drawn.contains(&[samples[spike].0, height]));
        }

        /// What is drawn are samples, in their order, and at most two a column.
        #[test]
        fn nothing_is_made_up_and_little_is_drawn(
            values in prop::collection::vec(-1.0..1.0f64, 1..2000),
            column_s in 1e-4..10.0f64,
        ) {
            let samples: Vec<_> = (0u32..).zip(&values).map(|(i, value)| (f64::from(i) * 1e-3, *value)).collect();
            let drawn = outline(samples.iter().copied(), column_s);
            prop_assert!(drawn.is_sorted_by(|a, b| a[0] < b[0]));
            prop_assert!(drawn.iter().all(|[t_s, value]| samples.contains(&(*t_s, *value))));
            let columns = (samples[samples.len() - 1].0 / column_s).floor() + 1.0;
            // Where a column's edge is rounded, there may be one more.
            prop_assert!(drawn.len() as f64 <= 2.0 * columns.min(samples.len() as f64) * 1.01 + 2.0);
        }
    }
}
