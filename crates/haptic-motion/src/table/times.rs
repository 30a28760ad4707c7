//! One model of the stamps of a table: which are wrong, where the clock fell back, and what is even underneath.
//!
//! Stamps of even samples are even, rounded to few digits, or given to many rows at once, with gaps between them. A
//! counter wraps around, a clock is reset, a second take begins, and some stamps are wrong. Decisions rest on
//! figures that a few rows cannot move, and are reported.

use crate::median::{extent, median};

/// Most stamps in a row that are wrong between right ones.
const MAX_WRONG_IN_A_ROW: usize = 3;

/// Of all stamps, one in so many may be wrong.
const WRONG_ONE_IN: usize = 100;

/// Of all rows, one in so many may begin anew after the clock fell back.
const TAKE_ONE_IN: usize = 64;

/// From so many usual steps on one row at least is missing.
const MIN_GAP_STEPS: f64 = 1.7;

/// A step beyond so many usual ones is a gap.
const GAP_STEPS: f64 = 2.5;

/// Steps are alike to this share of the usual one.
const ALIKE: f64 = 0.02;

/// Fewest rows that show a pattern.
const MIN_ROWS: usize = 64;

/// Share of rows with the stamp of the row before from which on stamps are of chunks.
const CHUNKED_SHARE: f64 = 0.3;

/// Share of steps that are alike from which on the others are rows that are missing.
const REGULAR_SHARE: f64 = 0.9;

/// Fewest double steps that are no missing rows where they come at even distances.
const MIN_AT_EVEN_DISTANCES: usize = 5;

/// Pause that is put where a clock fell back, s, and in usual steps, whichever is longer.
const PAUSE_S: f64 = 1.0;
const PAUSE_STEPS: f64 = 100.0;

/// When counters wrap around, s: those of 16 and 32 bits that count ns, us and ms; and a day.
const WRAPS_S: [f64; 6] = [0.065_536, 65.536, 4.294_967_296, 4_294.967_296, 4_294_967.296, 86_400.0];

/// The times of the rows of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Times {
    /// Of the rows that are kept, s; they grow.
    pub(super) t_s: Vec<f64>,
    /// The places of those rows, in their order.
    pub(super) kept: Vec<usize>,
    /// Usual time between two rows, s.
    pub(super) period_s: f64,
    /// The first row after a pause whose length is not known.
    pub(super) second_take: Option<usize>,
    /// What was decided, for people.
    pub(super) notes: Vec<String>,
}

/// Why stamps are no times: at this place the time goes back, as it does so often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Disorder {
    pub(super) at: usize,
    pub(super) falls: usize,
}

impl Times {
    /// Makes times of finite stamps, s. `name` says where a row is, for people.
    ///
    /// # Errors
    /// They go back too often to be those of a clock.
    pub(super) fn of(stamps: &[f64], name: impl Fn(usize) -> String) -> Result<Self, Disorder> {
        let mut times = Self {
            t_s: stamps.to_vec(),
            kept: (0..stamps.len()).collect(),
            period_s: 0.0,
            second_take: None,
            notes: Vec::new(),
        };
        times.leave_out_wrong_ones(&name)?;
        times.go_on_where_it_fell_back(&name)?;
        times.even_out();
        times.leave_out_repeated_ones();
        times.period_s = median_step_s(&times.t_s);
        times.tell_gaps();
        Ok(times)
    }

    /// The times for a person: rows, rate and duration.
    pub(super) fn summary(&self) -> String {
        let duration_s = self.t_s.last().unwrap_or(&0.0) - self.t_s.first().unwrap_or(&0.0);
        let rate_hz = if self.period_s > 0.0 { 1.0 / self.period_s } else { 0.0 };
        format!("{} rows, {rate_hz:.5} Hz, {duration_s:.3} s", self.t_s.len())
    }

    fn retain(&mut self, keeps: &[bool]) {
        retain(&mut self.t_s, keeps);
        retain(&mut self.kept, keeps);
    }

    /// A stamp beside which its neighbours agree with each other is wrong.
    fn leave_out_wrong_ones(&mut self, name: &impl Fn(usize) -> String) -> Result<(), Disorder> {
        let t = &self.t_s;
        let usual_s = median_step_s(t);
        let mut keeps = vec![true; t.len()];
        let mut at = 1;
        while at < t.len() {
            if t[at] >= t[at - 1] {
                at += 1;
                continue;
            }
            // The rows before are too late, or those from here on too early.
            let fits = |before: Option<f64>, after: Option<&f64>, between: usize| match (before, after) {
                (Some(before), Some(after)) => {
                    let step_s = after - before;
                    step_s >= 0.0 && step_s <= 2.0 * GAP_STEPS * (between + 1) as f64 * usual_s
                }
                // The first or the last rows of all.
                _ => between == 1,
            };
            let wrong = (1..=MAX_WRONG_IN_A_ROW).find_map(|count| {
                let late = at.checked_sub(count)?;
                if keeps[late..at].iter().all(|keep| *keep) && fits(late.checked_sub(1).map(|k| t[k]), t.get(at), count)
                {
                    return Some(late..at);
                }
                (at + count <= t.len() && fits(Some(t[at - 1]), t.get(at + count), count)).then(|| at..at + count)
            });
            match wrong {
                Some(rows) => {
                    at = rows.end.max(at) + 1;
                    keeps[rows].fill(false);
                }
                None => at += 1,
            }
        }
        let wrong: Vec<usize> = (0..keeps.len()).filter(|&row| !keeps[row]).collect();
        let Some(&first) = wrong.first() else { return Ok(()) };
        if t.len() < MIN_ROWS || wrong.len() * WRONG_ONE_IN > t.len().max(WRONG_ONE_IN) {
            let falls = || (1..t.len()).filter(|&at| t[at] < t[at - 1]);
            return Err(Disorder {
                at: falls().next().unwrap_or(first),
                falls: falls().count(),
            });
        }
        self.notes.push(match wrong.len() {
            1 => format!(
                "{}: the time {} s is wrong between its neighbours: left out",
                name(first),
                t[first]
            ),
            count => format!(
                "{count} times are wrong between their neighbours, the first in {} ({} s): left out",
                name(first),
                t[first]
            ),
        });
        self.retain(&keeps);
        Ok(())
    }

    /// A counter that wraps around goes on; another fall is a take of its own.
    fn go_on_where_it_fell_back(&mut self, name: &impl Fn(usize) -> String) -> Result<(), Disorder> {
        let usual_s = median_step_s(&self.t_s);
        let falls: Vec<usize> = (1..self.t_s.len())
            .filter(|&at| self.t_s[at] < self.t_s[at - 1])
            .collect();
        let Some(&first) = falls.first() else { return Ok(()) };
        if falls.len() * TAKE_ONE_IN > self.t_s.len() {
            return Err(Disorder {
                at: self.kept[first],
                falls: falls.len(),
            });
        }
        let (mut ahead_s, mut wrapped, mut takes) = (0.0, Vec::new(), Vec::new());
        let stamps = self.t_s.clone();
        for at in 1..stamps.len() {
            let (before_s, now_s) = (stamps[at - 1], stamps[at]);
            if now_s < before_s {
                let fits = |wrap_s: &&f64| {
                    let step_s = now_s + **wrap_s - before_s;
                    step_s >= 0.0 && step_s <= GAP_STEPS * usual_s
                };
                if let Some(wrap_s) = WRAPS_S.iter().find(fits) {
                    ahead_s += wrap_s;
                    wrapped.push(*wrap_s);
                } else {
                    ahead_s += before_s - now_s + PAUSE_S.max(PAUSE_STEPS * usual_s);
                    takes.push(at);
                }
            }
            self.t_s[at] = now_s + ahead_s;
        }
        if let Some(wrap_s) = wrapped.first() {
            self.notes.push(format!(
                "the clock wraps around after {wrap_s} s, {} times: it goes on",
                wrapped.len()
            ));
        }
        self.second_take = takes.first().map(|&at| self.kept[at]);
        for &at in &takes {
            self.notes.push(format!(
                "{}: the clock falls back from {} s to {} s, as one that was reset or a second take: what follows is \
                 taken as after a pause, whose length is not known",
                name(self.kept[at]),
                stamps[at - 1],
                stamps[at]
            ));
        }
        Ok(())
    }

    /// Stamps that are rounded, or of chunks of rows, are made even between gaps.
    fn even_out(&mut self) {
        if self.t_s.len() < MIN_ROWS {
            return;
        }
        let runs = Runs::of(&self.t_s);
        let Some(pattern) = runs.pattern(&self.t_s) else { return };
        let mut even = Vec::with_capacity(self.t_s.len());
        for stretch in runs.stretches() {
            let Some(mut times) = pattern.evened(&self.t_s[stretch.clone()], runs.period_s) else {
                return;
            };
            even.append(&mut times);
        }
        // Between two stretches the time grows on.
        if even.windows(2).any(|pair| pair[1] <= pair[0]) {
            return;
        }
        self.t_s = even;
        self.notes.push(match pattern {
            Pattern::Rounded { to_s } => {
                format!("times are rounded to {:.6} ms: the rows are taken as even", 1e3 * to_s)
            }
            Pattern::Chunks { rows, .. } => {
                format!("times are those of chunks of {rows:.0} rows: the rows are taken as even")
            }
        });
    }

    fn tell_gaps(&mut self) {
        let steps = self.t_s.windows(2).map(|pair| pair[1] - pair[0]);
        let gaps: Vec<f64> = steps.filter(|step| *step > MIN_GAP_STEPS * self.period_s).collect();
        // Where rows come at any time, none is missing.
        if !gaps.is_empty() && gaps.len() as f64 <= (1.0 - REGULAR_SHARE) * self.t_s.len() as f64 {
            self.notes.push(format!(
                "rows are missing in {} place{}, {:.3} s in all",
                gaps.len(),
                if gaps.len() == 1 { "" } else { "s" },
                gaps.iter().sum::<f64>() - gaps.len() as f64 * self.period_s
            ));
        }
    }

    fn leave_out_repeated_ones(&mut self) {
        let keeps: Vec<bool> = std::iter::once(true)
            .chain(self.t_s.windows(2).map(|pair| pair[1] > pair[0]))
            .collect();
        let repeated = keeps.iter().filter(|keep| !**keep).count();
        if repeated > 0 {
            self.retain(&keeps);
            self.notes.push(format!(
                "{repeated} rows repeat the time of the row before, and are left out"
            ));
        }
    }
}

/// Leaves out the values that are not kept.
pub(super) fn retain<T>(values: &mut Vec<T>, keeps: &[bool]) {
    let mut each = keeps.iter();
    values.retain(|_| each.next().copied().unwrap_or(false));
}

/// The median of the steps that go on, s.
fn median_step_s(t_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t_s
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step > 0.0)
        .collect();
    median(&mut steps).unwrap_or(0.0)
}

/// What stamps do that are even underneath.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pattern {
    /// They are written with few digits.
    Rounded { to_s: f64 },
    /// Several rows have one stamp.
    Chunks { rows: f64, longest_s: f64 },
}

impl Pattern {
    /// Even times in the place of the stamps of a stretch without a gap, where these lie within what the pattern
    /// explains.
    fn evened(self, stamps: &[f64], period_s: f64) -> Option<Vec<f64>> {
        // The line of least squares: the ends of a stretch are off by as much as any other stamp.
        let middle = 0.5 * (stamps.len() - 1) as f64;
        let (mut product, mut square, mut mean) = (0.0, 0.0, 0.0);
        for (at, stamp) in stamps.iter().enumerate() {
            let place = at as f64 - middle;
            product += place * (stamp - stamps[0]);
            square += place * place;
            mean += (stamp - stamps[0]) / stamps.len() as f64;
        }
        let own_s = product / square;
        // A few steps tell the period less well than all others.
        let is_own = stamps.len() >= MIN_ROWS && (own_s - period_s).abs() <= ALIKE * period_s;
        let step_s = if is_own { own_s } else { period_s };
        let even: Vec<f64> = (0..stamps.len())
            .map(|at| stamps[0] + mean + (at as f64 - middle) * step_s)
            .collect();
        let most_s = match self {
            // A line through few steps is not quite that of the clock.
            Self::Rounded { to_s } => 1.25 * to_s,
            // Each comes when the computer has time for it.
            Self::Chunks { longest_s, .. } => 2.0 * longest_s,
        };
        let (least, greatest) = extent(stamps.iter().zip(&even).map(|(stamp, even)| stamp - even));
        (greatest - least <= most_s + 1e-3 * period_s).then_some(even)
    }
}

/// Rows of equal stamps, and the steps between them.
struct Runs {
    /// First row of each, and the number of rows at the end.
    begins: Vec<usize>,
    /// From each to the next, s.
    steps: Vec<f64>,
    /// Whether that is a gap.
    is_gap: Vec<bool>,
    /// Mean time of a row outside of gaps, s.
    period_s: f64,
}

impl Runs {
    fn of(t_s: &[f64]) -> Self {
        let mut begins: Vec<usize> = (0..t_s.len()).filter(|&at| at == 0 || t_s[at] > t_s[at - 1]).collect();
        begins.push(t_s.len());
        let rows = |run: usize| (begins[run + 1] - begins[run]) as f64;
        let steps: Vec<f64> = (0..begins.len() - 2)
            .map(|run| t_s[begins[run + 1]] - t_s[begins[run]])
            .collect();
        let mut by_row: Vec<f64> = steps.iter().enumerate().map(|(run, step)| step / rows(run)).collect();
        let (usual_s, usual_row_s) = (median_step_s(t_s), median(&mut by_row).unwrap_or(0.0));
        let is_gap: Vec<bool> = steps
            .iter()
            .enumerate()
            .map(|(run, step)| *step > GAP_STEPS * usual_s.max(rows(run) * usual_row_s))
            .collect();
        let (mut time_s, mut count) = (0.0, 0.0);
        for (run, step) in steps.iter().enumerate().filter(|(run, _)| !is_gap[*run]) {
            time_s += step;
            count += rows(run);
        }
        Self {
            period_s: if count > 0.0 { time_s / count } else { usual_row_s },
            begins,
            steps,
            is_gap,
        }
    }

    /// The rows between gaps.
    fn stretches(&self) -> Vec<std::ops::Range<usize>> {
        let mut ends: Vec<usize> = (0..self.steps.len())
            .filter(|&run| self.is_gap[run])
            .map(|run| self.begins[run + 1])
            .collect();
        ends.push(self.begins[self.begins.len() - 1]);
        let mut begin = 0;
        ends.into_iter()
            .map(|end| std::mem::replace(&mut begin, end)..end)
            .collect()
    }

    fn pattern(&self, t_s: &[f64]) -> Option<Pattern> {
        let steps: Vec<(usize, f64)> = (0..self.steps.len())
            .filter(|&run| !self.is_gap[run])
            .map(|run| (run, self.steps[run]))
            .collect();
        let (least_s, longest_s) = extent(steps.iter().map(|(_, step)| *step));
        let repeated = t_s.len() + 1 - self.begins.len();
        let is_either = |one: f64, other: f64, tolerance: f64| {
            steps
                .iter()
                .all(|(_, step)| (step - one).abs().min((step - other).abs()) <= tolerance)
        };
        let is_chunked = repeated as f64 >= CHUNKED_SHARE * t_s.len() as f64;
        if repeated > 0 && (is_chunked || is_either(least_s, least_s, ALIKE * least_s)) {
            // A clock that is written with few digits repeats stamps, and steps by its last digit alone.
            if is_either(least_s, least_s, ALIKE * least_s) && longest_s <= 4.0 * self.period_s {
                return Some(Pattern::Rounded { to_s: least_s });
            }
            let rows = t_s.len() as f64 / (self.begins.len() - 1) as f64;
            return is_chunked.then_some(Pattern::Chunks { rows, longest_s });
        }
        let to_s = longest_s - least_s;
        if repeated > 0 || to_s <= ALIKE * self.period_s || !is_either(least_s, longest_s, ALIKE * to_s) {
            return None;
        }
        // Rounded times step by two neighbouring multiples of the last digit, and the longer step comes at even
        // distances; else rows are missing.
        let long: Vec<usize> = steps
            .iter()
            .filter(|(_, step)| step - least_s > 0.5 * to_s)
            .map(|(run, _)| *run)
            .collect();
        let is_rare = long.len() as f64 <= (1.0 - REGULAR_SHARE) * steps.len() as f64;
        let is_double = (to_s - least_s).abs() <= ALIKE * least_s;
        let distances = || long.windows(2).map(|pair| pair[1] - pair[0]);
        let (nearest, farthest) = (distances().min().unwrap_or(0), distances().max().unwrap_or(0));
        let is_at_even_distances = long.len() >= MIN_AT_EVEN_DISTANCES && farthest - nearest <= 1;
        (!is_rare || !is_double || is_at_even_distances).then_some(Pattern::Rounded { to_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(stamps: &[f64]) -> Times {
        Times::of(stamps, |row| format!("row {row}")).expect("they are times")
    }

    /// The greatest distance of the kept rows from their true times, but for a shift of all.
    fn error_s(times: &Times, truth: impl Fn(usize) -> f64) -> f64 {
        let off = || times.t_s.iter().zip(&times.kept).map(|(t, &row)| t - truth(row));
        let middle = 0.5 * (off().fold(f64::MAX, f64::min) + off().fold(f64::MIN, f64::max));
        off().map(|off| (off - middle).abs()).fold(0.0, f64::max)
    }

    fn says(times: &Times, part: &str) -> bool {
        times.notes.iter().any(|note| note.contains(part))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn even_stamps_stay_as_they_are(rate_hz in 20.0..20_000.0f64, start_s in -10.0..2e9f64, rows in 100..3000_usize) {
            let stamps: Vec<f64> = (0..rows).map(|k| start_s + k as f64 / rate_hz).collect();
            let times = of(&stamps);
            prop_assert!(times.t_s == stamps && times.kept.len() == rows, "{:?}", times.notes);
        }

        /// Few digits: the times between them come back to a fraction of the last one.
        #[test]
        fn rounded_stamps_are_even(rate_hz in 60.0..3000.0f64, rows in 1000..4000_usize, digit in 0..2_u8) {
            let to_s = [1e-3, 1e-2][usize::from(digit)];
            let stamps: Vec<f64> = (0..rows).map(|k| (k as f64 / rate_hz / to_s).round() * to_s).collect();
            let whole = 1.0 / rate_hz / to_s;
            // Of those that come out even nothing is to be seen.
            prop_assume!((whole - whole.round()).abs() > 1e-3 || whole < 0.5);
            prop_assume!(whole > 0.06);
            let times = of(&stamps);
            prop_assert!(times.kept.len() == rows, "{:?}", times.notes);
            let error_s = error_s(&times, |row| row as f64 / rate_hz);
            prop_assert!(error_s <= 0.6 * to_s, "{error_s} {:?}", times.notes);
        }

        #[test]
        fn stamps_of_chunks_are_even(
            rate_hz in 50.0..5000.0f64, chunk in 2..64_usize, chunks in 40..100_usize, last in 1..64_usize,
            jitter in prop::collection::vec(-0.2..0.2f64, 100),
        ) {
            let rows = chunk * chunks + last.min(chunk);
            let arrives = |k: usize| {
                let number = k / chunk;
                (number as f64 + jitter[number % jitter.len()]) * chunk as f64 / rate_hz
            };
            let stamps: Vec<f64> = (0..rows).map(arrives).collect();
            let times = of(&stamps);
            prop_assert!(times.kept.len() == rows, "{:?}", times.notes);
            let period_s = (times.t_s[rows - 1] - times.t_s[0]) / (rows - 1) as f64;
            prop_assert!((period_s * rate_hz - 1.0).abs() < 0.03, "{} {:?}", period_s * rate_hz, times.notes);
        }

        /// A gap of an hour is a gap, and missing rows are none but that.
        #[test]
        fn gaps_and_missing_rows_are_left_as_they_are(
            rate_hz in 50.0..5000.0f64, gap_s in 1.0..1e5f64, at in 100..900_usize,
            missing in prop::collection::btree_set(2..998_usize, 1..6),
        ) {
            let truth = |k: usize| k as f64 / rate_hz + if k < at { 0.0 } else { gap_s };
            let stamps: Vec<f64> = (0..1000).filter(|k| !missing.contains(k)).map(truth).collect();
            let times = of(&stamps);
            prop_assert!(times.t_s == stamps && times.kept.len() == stamps.len(), "{:?}", times.notes);
            prop_assert!((times.period_s * rate_hz - 1.0).abs() < 1e-6 && says(&times, "rows are missing"));
        }

        #[test]
        fn wrong_stamps_are_left_out(
            rate_hz in 50.0..5000.0f64,
            wrong in prop::collection::btree_map(1..199_usize, prop_oneof![-1e5..-1.0f64, 1.0..1e5f64], 1..8),
        ) {
            let truth = |k: usize| 10.0 + k as f64 / rate_hz;
            let stamps: Vec<f64> = (0..2000)
                .map(|k| truth(k) + if k % 10 == 5 { wrong.get(&(k / 10)).copied().unwrap_or(0.0) } else { 0.0 })
                .collect();
            let times = of(&stamps);
            prop_assert_eq!(times.kept.len(), 2000 - wrong.len());
            prop_assert!(times.t_s.iter().zip(&times.kept).all(|(t, &row)| *t == truth(row)));
            prop_assert!(says(&times, "wrong between"));
        }

        #[test]
        fn a_counter_that_wraps_around_goes_on(rate_hz in 100.0..5000.0f64, place in 0..3_usize, start in 0.0..1.0f64) {
            let wrap_s = [65.536, 4_294.967_296, 4_294_967.296][place];
            let begin = wrap_s - (10.0 + 40.0 * start) / rate_hz;
            let stamps: Vec<f64> = (0..200).map(|k| (begin + k as f64 / rate_hz) % wrap_s).collect();
            let times = of(&stamps);
            prop_assert!(says(&times, "wraps around"), "{:?}", times.notes);
            prop_assert!(times.t_s.iter().enumerate().all(|(k, t)| (t - begin - k as f64 / rate_hz).abs() < 1e-6), "{:?}", times.notes);
        }

        #[test]
        fn a_second_take_is_taken_as_after_a_pause(rate_hz in 50.0..5000.0f64, first in 500..1500_usize) {
            let length_s = first as f64 / rate_hz;
            // As long as a counter takes for a turn: that is taken for one.
            prop_assume!(WRAPS_S.iter().all(|wrap_s| (length_s - wrap_s).abs() > 5.0 / rate_hz));
            let stamps: Vec<f64> = (0..first).chain(0..1000).map(|k| 3.0 + k as f64 / rate_hz).collect();
            let times = of(&stamps);
            prop_assert!(says(&times, "falls back") && !says(&times, "sort"), "{:?}", times.notes);
            prop_assert!(times.t_s.windows(2).all(|pair| pair[1] > pair[0]));
            prop_assert!(times.t_s[first] - times.t_s[first - 1] > 0.99);
            prop_assert_eq!(times.kept.len(), stamps.len());
        }

        /// Samples that were truly uneven stay so.
        #[test]
        fn jitter_of_the_samples_is_no_rounding(seed in 0..1000_u64) {
            let mut random = fastrand::Rng::with_seed(seed);
            let stamps: Vec<f64> = (0..2000).map(|k| 1e-3 * (f64::from(k) + 0.4 * random.f64())).collect();
            let times = of(&stamps);
            prop_assert!(times.t_s == stamps, "{:?}", times.notes);
        }
    }

    #[test]
    fn what_goes_back_all_the_time_is_no_clock() {
        let stamps: Vec<f64> = (0..1000).map(|k| f64::from(k * 7919 % 1000)).collect();
        assert!(Times::of(&stamps, |row| row.to_string()).is_err());
    }

    #[test]
    fn the_summary_has_rows_rate_and_duration() {
        let stamps: Vec<f64> = (0..5001).map(|k| f64::from(k) * 4e-3).collect();
        assert_eq!(of(&stamps).summary(), "5001 rows, 250.00000 Hz, 20.000 s");
    }
}
