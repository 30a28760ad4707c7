//! Two clocks: the shift at which two motions are the same.

use super::signal::{MIN_S, Signal};

/// Time between the positions that are compared at every shift, s: a hand moves at 10 Hz at most.
const COARSE_S: f64 = 0.02;
/// Longest part that is looked for in the other record, s: beyond it the search is slow, and no surer.
const MAX_S: f64 = 120.0;
/// Least part of the shorter record that has to overlap.
const MIN_OVERLAP: f64 = 0.5;

/// How two motions fit best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Alignment {
    /// Time of the second record less that of the first, s.
    pub(super) shift_s: f64,
    /// Position of the second less that of the first, m.
    pub(super) position_offset_m: f64,
    /// Agreement of the positions: 1 for the same motion, less for another path or another size.
    pub(super) agreement: f64,
    /// Time that both hold, s.
    pub(super) overlap_s: f64,
}

/// The best alignment of two motions: every shift on a coarse grid, then to a small part of a sample.
pub(super) fn find(first: &Signal, second: &Signal) -> Alignment {
    let coarse = |signal: &Signal| {
        let every = signal.samples_in(COARSE_S);
        let positions: Vec<f64> = signal.position_m.iter().step_by(every).copied().collect();
        (positions, signal.period_s * every as f64)
    };
    let ((own, step_s), (other, _)) = (coarse(first), coarse(second));
    let is_first_shorter = own.len() <= other.len();
    let (shorter, longer) = if is_first_shorter {
        (&own, &other)
    } else {
        (&other, &own)
    };
    let (part, begins) = liveliest(shorter, step_s);
    let lag = best_lag(part, longer) - signed(begins);
    let lag = if is_first_shorter { lag } else { -lag };
    let coarse_shift_s = second.start_s - first.start_s + lag as f64 * step_s;
    Alignment::at(first, second, refined(first, second, coarse_shift_s, step_s))
}

impl Alignment {
    /// How two motions fit at a shift, s.
    pub(super) fn at(first: &Signal, second: &Signal, shift_s: f64) -> Self {
        let (from_s, count) = overlap(first, second, shift_s);
        let at = |signal: &Signal, from_s: f64| -> Vec<f64> {
            (0..count)
                .map(|index| signal.value_at(&signal.position_m, from_s + signal.period_s * index as f64))
                .collect()
        };
        let (agreement, position_offset_m) = agreement(&at(first, from_s), &at(second, from_s + shift_s));
        Self {
            shift_s,
            position_offset_m,
            agreement,
            overlap_s: first.period_s * count.saturating_sub(1) as f64,
        }
    }

    /// Begin of the common time on the first clock, s, and its samples.
    pub(super) fn overlap(&self, first: &Signal, second: &Signal) -> (f64, usize) {
        overlap(first, second, self.shift_s)
    }

    /// The middle of the common time on the second clock, s.
    pub(super) fn middle_s(&self, first: &Signal, second: &Signal) -> f64 {
        let (from_s, _) = self.overlap(first, second);
        from_s + 0.5 * self.overlap_s + self.shift_s
    }

    /// Both signals over the time that both hold, at the same instants.
    pub(super) fn common(&self, first: &Signal, second: &Signal) -> (Signal, Signal) {
        let (from_s, count) = self.overlap(first, second);
        (first.part(from_s, count), second.part(from_s + self.shift_s, count))
    }
}

fn signed(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// The part of a motion, as long as is looked for, with the longest path; and where it begins.
fn liveliest(positions: &[f64], step_s: f64) -> (&[f64], usize) {
    #[expect(clippy::cast_sign_loss, reason = "a count of samples")]
    let length = (MAX_S / step_s) as usize;
    if positions.len() <= length {
        return (positions, 0);
    }
    let travel = |begin: usize| {
        let part = &positions[begin..begin + length];
        part.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>()
    };
    let last = positions.len() - length;
    let begins = (0..=last)
        .step_by((length / 4).max(1))
        .max_by(|&a, &b| travel(a).total_cmp(&travel(b)))
        .unwrap_or(0);
    (&positions[begins..begins + length], begins)
}

/// How many samples of `longer` lie before the place where `part` fits best; negative where `part`
/// begins earlier.
fn best_lag(part: &[f64], longer: &[f64]) -> i64 {
    #[expect(clippy::cast_sign_loss, reason = "a count of samples")]
    let least = (((MIN_OVERLAP * part.len() as f64) as usize).max((MIN_S / COARSE_S) as usize)).min(part.len());
    let (earliest, latest) = (signed(least) - signed(part.len()), signed(longer.len()) - signed(least));
    let score = |lag: i64| {
        let skipped = usize::try_from(-lag).unwrap_or(0);
        let from = usize::try_from(lag).unwrap_or(0);
        let count = (part.len() - skipped).min(longer.len() - from);
        // A longer overlap counts for more: a short one fits by chance.
        agreement(&part[skipped..skipped + count], &longer[from..from + count]).0
            * (count as f64 / part.len() as f64).powf(0.1)
    };
    (earliest..=latest)
        .map(|lag| (lag, score(lag)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(lag, _)| lag)
}

/// Agreement of two columns that have their own origins (the concordance of Lin 1989 without its shift),
/// and the mean of the second less that of the first.
fn agreement(first: &[f64], second: &[f64]) -> (f64, f64) {
    let count = first.len().max(1) as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (own, other) = (mean(first), mean(second));
    let (mut both, mut squares, mut other_squares) = (0.0, 0.0, 0.0);
    for (a, b) in first.iter().zip(second) {
        both += (a - own) * (b - other);
        squares += (a - own) * (a - own);
        other_squares += (b - other) * (b - other);
    }
    let size = 0.5 * (squares + other_squares);
    (if size > 0.0 { both / size } else { 0.0 }, other - own)
}

/// Begin of the common time on the first clock, s, and its samples.
fn overlap(first: &Signal, second: &Signal, shift_s: f64) -> (f64, usize) {
    let from_s = first.start_s.max(second.start_s - shift_s);
    let to_s = (first.start_s + first.length_s()).min(second.start_s + second.length_s() - shift_s);
    #[expect(clippy::cast_sign_loss, reason = "a count of samples")]
    let count = ((to_s - from_s).max(0.0) / first.period_s + 1e-6) as usize + 1;
    (from_s, count)
}

/// The best shift around a coarse one, by golden sections.
fn refined(first: &Signal, second: &Signal, coarse_s: f64, step_s: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let score = |shift_s: f64| Alignment::at(first, second, shift_s).agreement;
    let (mut low, mut high) = (coarse_s - step_s, coarse_s + step_s);
    let inner = |low: f64, high: f64| (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (score(left), score(right));
    while high - low > 1e-3 * first.period_s {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = inner(low, high).0;
            at_left = score(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = inner(low, high).1;
            at_right = score(right);
        }
    }
    0.5 * (low + high)
}
