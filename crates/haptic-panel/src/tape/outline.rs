//! Many samples in few points: of each column of pixels the least and the greatest value, in the
//! order of time.
//!
//! Columns begin at multiples of their width on the daemon's clock instead of at the edge of the plot,
//! so that a scrolling line does not shimmer. A spike of a single sample is the extreme of its column,
//! so it is drawn at any zoom.

/// A value and the index on its tape of the sample that has it.
pub(crate) type Extreme = (f64, usize);

/// Between the points of a line, where it is broken because samples are missing.
pub(crate) const BREAK: [f64; 2] = [f64::NAN; 2];

/// A sample or a bucket.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<S> {
    /// Time of its first sample, s, which decides its column.
    pub(crate) first_s: f64,
    /// Samples are missing before it, for longer than a column.
    pub(crate) follows_gap: bool,
    pub(crate) what: S,
}

/// Points of `lines` lines through spans (samples or buckets) in the order of time, with columns of
/// `column_s`.
///
/// `extremes` gives the least and the greatest value of a line in a span, `time_of` the time of an index. All lines are
/// made in one pass: a minute of samples exceeds the processor's cache.
pub(crate) fn outlines<S>(
    spans: impl IntoIterator<Item = Span<S>>,
    lines: usize,
    extremes: impl Fn(&S, usize) -> [Extreme; 2],
    column_s: f64,
    time_of: impl Fn(usize) -> f64,
) -> Vec<Vec<[f64; 2]>> {
    let mut points = vec![Vec::new(); lines];
    let mut columns: Vec<Column> = Vec::with_capacity(lines);
    let mut until_s = f64::NEG_INFINITY;
    let mut draw = |columns: &mut Vec<Column>, then_breaks: bool| {
        for (column, line) in columns.drain(..).zip(&mut points) {
            column.draw(line, &time_of);
            line.extend(then_breaks.then_some(BREAK));
        }
    };
    for Span {
        first_s,
        follows_gap,
        what,
    } in spans
    {
        if first_s < until_s {
            for (line, column) in columns.iter_mut().enumerate() {
                column.merge(extremes(&what, line));
            }
        } else {
            until_s = end_of_column(first_s, column_s);
            draw(&mut columns, follows_gap);
            columns.extend((0..lines).map(|line| Column(extremes(&what, line))));
        }
    }
    draw(&mut columns, false);
    points
}

/// End of the column that contains a time. It is computed once a column instead of once a sample.
pub(crate) fn end_of_column(t_s: f64, column_s: f64) -> f64 {
    ((t_s / column_s).floor() + 1.0) * column_s
}

/// The least and the greatest value in one column of pixels.
#[derive(Clone, Copy, Debug)]
struct Column([Extreme; 2]);

impl Column {
    fn merge(&mut self, [least, greatest]: [Extreme; 2]) {
        if least.0 < self.0[0].0 {
            self.0[0] = least;
        }
        // Of equal values the newer, so that a constant line has both its ends.
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
