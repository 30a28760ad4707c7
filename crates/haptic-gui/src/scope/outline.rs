//! Many samples in few points: of each column of pixels the least and the greatest value, in the order of time.
//!
//! Columns begin at multiples of their width on the daemon's clock and not at the edge of the plot, so that a line that
//! scrolls by does not shimmer. A spike of a single sample is the extreme of its column, so it is drawn at any zoom.

/// A value and the place on its tape of the sample that has it.
pub(crate) type Extreme = (f64, usize);

/// A sample, or several that fall into one column together, as the least and the greatest value of each line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<const N: usize> {
    /// Time of the first of them, s: it decides in which column they are.
    pub(crate) first_s: f64,
    pub(crate) extremes: [[Extreme; 2]; N],
}

/// Points of lines through spans in the order of time, with columns `column_s` wide; `time_of` gives the time of a place. All lines are made in
/// one pass: a minute of samples is more than the processor's cache holds.
pub(crate) fn outlines<const N: usize>(
    spans: impl IntoIterator<Item = Span<N>>,
    column_s: f64,
    time_of: impl Fn(usize) -> f64,
) -> [Vec<[f64; 2]>; N] {
    let mut lines = std::array::from_fn(|_| Vec::new());
    let mut columns: Option<[Column; N]> = None;
    let mut until_s = f64::NEG_INFINITY;
    let mut draw = |columns: [Column; N]| {
        for (column, line) in columns.into_iter().zip(&mut lines) {
            column.draw(line, &time_of);
        }
    };
    for Span { first_s, extremes } in spans {
        match &mut columns {
            Some(columns) if first_s < until_s => {
                for (column, extremes) in columns.iter_mut().zip(extremes) {
                    column.take(extremes);
                }
            }
            _ => {
                until_s = end_of_column(first_s, column_s);
                if let Some(whole) = columns.replace(extremes.map(Column)) {
                    draw(whole);
                }
            }
        }
    }
    if let Some(last) = columns {
        draw(last);
    }
    lines
}

/// Where the column ends that a time lies in. A division for each column and not for each sample: there may be a hundred in one.
pub(crate) fn end_of_column(t_s: f64, column_s: f64) -> f64 {
    ((t_s / column_s).floor() + 1.0) * column_s
}

/// What falls into one column of pixels: the least and the greatest value.
#[derive(Clone, Copy, Debug)]
struct Column([Extreme; 2]);

impl Column {
    fn take(&mut self, [least, greatest]: [Extreme; 2]) {
        if least.0 < self.0[0].0 {
            self.0[0] = least;
        }
        // The newer of two alike, so that a line at rest has both its ends.
        if greatest.0 >= self.0[1].0 {
            self.0[1] = greatest;
        }
    }

    fn draw(self, points: &mut Vec<[f64; 2]>, time_of: impl Fn(usize) -> f64) {
        let mut ends = self.0;
        ends.sort_by_key(|(_, place)| *place);
        let [first, second] = ends.map(|(value, place)| [time_of(place), value]);
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
    fn outline(samples: &[(f64, f64)], column_s: f64) -> Vec<[f64; 2]> {
        let spans = samples.iter().enumerate().map(|(place, (t_s, value))| Span {
            first_s: *t_s,
            extremes: [[(*value, place); 2]],
        });
        let [line] = outlines(spans, column_s, |place| samples[place].0);
        line
    }

    #[test]
    fn samples_fewer_than_columns_are_all_drawn() {
        let samples = [(0.0, 1.0), (1.0, 2.0), (2.0, 1.5)];
        let drawn = outline(&samples, 0.5);
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
            let drawn = outline(&samples, column_s);
            prop_assert!(drawn.contains(&[samples[spike].0, height]));
        }

        /// What is drawn are samples, in their order, and at most two a column.
        #[test]
        fn nothing_is_made_up_and_little_is_drawn(
            values in prop::collection::vec(-1.0..1.0f64, 1..2000),
            column_s in 1e-4..10.0f64,
        ) {
            let samples: Vec<_> = (0u32..).zip(&values).map(|(i, value)| (f64::from(i) * 1e-3, *value)).collect();
            let drawn = outline(&samples, column_s);
            prop_assert!(drawn.is_sorted_by(|a, b| a[0] < b[0]));
            prop_assert!(drawn.iter().all(|[t_s, value]| samples.contains(&(*t_s, *value))));
            let columns = (samples[samples.len() - 1].0 / column_s).floor() + 1.0;
            // Where a column's edge is rounded, there may be one more.
            prop_assert!(drawn.len() as f64 <= 2.0 * columns.min(samples.len() as f64) * 1.01 + 2.0);
        }
    }
}
