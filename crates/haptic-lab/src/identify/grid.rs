//! A record on an even grid of times, with the samples marked that hold no information. It is made once for all that is
//! done with a record.

use super::karnopp::MotionEstimate;
use super::options::Record;
use crate::gaps::{self, SAME_SHARE, in_gaps};
use crate::motion::{between, places};
use crate::smoothing::{encoder_step, white_noise, whole};
use haptic_motion::median::{extent, span_of_nine_tenths};
use std::cell::OnceCell;

/// Standard deviations by which a single force must lie beyond both of its neighbours to be a glitch, where that is
/// also more than half of what nine tenths of the forces span: at a low rate a breakaway is a single sample, too.
const GLITCH_DEVIATIONS: f64 = 10.0;

/// Shortest run at the largest force that counts as a saturated sensor or motor, in samples.
const SATURATED_RUN: usize = 5;

/// Share of samples between the extremes up to which a force only switches between these.
const MIN_BETWEEN: f64 = 0.1;

/// Share of the samples between the extremes that repeat the one before, from which on a force is held, for as long as
/// is taken for the end of a sensor's range.
const MAX_HELD: f64 = 0.75;

/// A record on an even grid, and what its positions say of the motion.
#[derive(Debug)]
pub(super) struct Even {
    pub(super) grid: Grid,
    /// Step of the position's encoder, m, where it is known.
    known_step_m: Option<f64>,
    /// The same, else the step that the record's own samples show.
    pub(super) step_m: Option<f64>,
    /// Samples of the record.
    pub(super) samples: usize,
    motion: OnceCell<MotionEstimate>,
}

impl Even {
    /// Of a checked record.
    pub(super) fn new(record: &Record) -> Self {
        Self {
            grid: Grid::new(record),
            known_step_m: record.resolution_m,
            step_m: record.resolution_m.or_else(|| encoder_step(&record.position_m)),
            samples: record.t_s.len(),
            motion: OnceCell::new(),
        }
    }

    /// Where the mass slides, and where it rests.
    pub(super) fn motion(&self) -> &MotionEstimate {
        self.motion
            .get_or_init(|| MotionEstimate::new(&self.grid, self.known_step_m))
    }
}

/// An evenly sampled record.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Time between samples, s.
    pub(super) period_s: f64,
    /// Time of the first sample, s.
    pub(super) start_s: f64,
    /// Position, m.
    pub(super) position_m: Vec<f64>,
    /// Driving force, N.
    pub(super) force_n: Vec<f64>,
    /// Whether the samples around it are there, and the force is within the sensor's range.
    pub(super) is_valid: Vec<bool>,
    /// Whether it lies in a gap of the record.
    pub(super) is_in_gap: Vec<bool>,
    /// What is worth a remark: gaps, jitter, saturation.
    pub(super) notes: Vec<String>,
    /// Share of the samples whose force is saturated.
    pub(super) saturated_share: f64,
}

impl Grid {
    /// Puts a checked record on the grid of its usual period.
    pub(super) fn new(record: &Record) -> Self {
        let t = &record.t_s;
        let period_s = mean_period_s(t);
        let start_s = t[0];
        let is_even = t
            .iter()
            .enumerate()
            .all(|(index, t_s)| (t_s - start_s - index as f64 * period_s).abs() <= SAME_SHARE * period_s);
        let mut grid = if is_even {
            Self {
                period_s,
                start_s,
                position_m: record.position_m.clone(),
                force_n: record.force_n.clone(),
                is_valid: vec![true; t.len()],
                is_in_gap: vec![false; t.len()],
                notes: Vec::new(),
                saturated_share: 0.0,
            }
        } else {
            Self::resampled(record, period_s)
        };
        grid.remove_glitches();
        grid.mark_saturated();
        grid
    }

    /// Cubic between positions, since their second derivative is wanted; linear between forces.
    fn resampled(record: &Record, period_s: f64) -> Self {
        let t = &record.t_s;
        let start_s = t[0];
        let last = t.len() - 1;
        let count = whole((t[last] - start_s) / period_s) + 1;
        let mut grid = Self {
            period_s,
            start_s,
            position_m: Vec::with_capacity(count),
            force_n: Vec::with_capacity(count),
            is_valid: Vec::new(),
            is_in_gap: Vec::new(),
            notes: Vec::new(),
            saturated_share: 0.0,
        };
        let times = || (0..count).map(|index| start_s + index as f64 * period_s);
        for (at, place) in times().zip(places(t, times())) {
            grid.force_n.push(between(&record.force_n, place));
            grid.position_m.push(cubic(t, &record.position_m, place.0, at));
        }
        grid.is_in_gap = in_gaps(t, times(), 0.0);
        grid.is_valid = grid.is_in_gap.iter().map(|is_in_gap| !is_in_gap).collect();
        let gaps: Vec<f64> = gaps::gaps(t).map(|[before, after]| after - before).collect();
        if !gaps.is_empty() {
            grid.notes.push(format!(
                "{} gaps, {:.3} s in all, are left out",
                gaps.len(),
                gaps.iter().sum::<f64>()
            ));
        }
        let jitter = steps_without_gaps(t)
            .map(|step_s| (step_s - period_s).abs())
            .fold(0.0, f64::max);
        grid.notes.push(format!(
            "uneven times, up to {:.2} ms from the period of {:.3} ms: resampled",
            jitter * 1e3,
            period_s * 1e3
        ));
        grid
    }

    /// Puts single forces far from both neighbours between them: a glitch of the sensor or its wire.
    fn remove_glitches(&mut self) {
        let half_span = 0.5 * span_of_nine_tenths(&self.force_n);
        let limit = half_span.max(GLITCH_DEVIATIONS * white_noise(&self.force_n, &self.is_valid));
        let mut glitches = 0_u64;
        for at in 1..self.len() - 1 {
            let [before, force, after] = [self.force_n[at - 1], self.force_n[at], self.force_n[at + 1]];
            if (force - before.max(after)).max(before.min(after) - force) > limit {
                self.force_n[at] = f64::midpoint(before, after);
                glitches += 1;
            }
        }
        if glitches > 0 {
            self.notes.push(format!(
                "{glitches} single forces far from their neighbours are left out"
            ));
        }
    }

    /// A force that stays at the record's extreme value shows only that it was at least as large.
    fn mark_saturated(&mut self) {
        if is_stepwise(&self.force_n) {
            return;
        }
        let mut saturated = 0;
        for sign in [1.0, -1.0] {
            let extreme = self.force_n.iter().map(|force| sign * force).fold(f64::MIN, f64::max);
            let (mut begin, mut is_saturated) = (0, false);
            for index in 0..=self.force_n.len() {
                let at_extreme = self.force_n.get(index).is_some_and(|force| sign * force == extreme);
                if at_extreme {
                    continue;
                }
                if index - begin >= SATURATED_RUN {
                    saturated += index - begin;
                    is_saturated = true;
                }
                begin = index + 1;
            }
            // Beside the limit noise is cut off on one side.
            let forces = if is_saturated { &self.force_n[..] } else { &[] };
            for (index, force) in forces.iter().enumerate() {
                if sign * force == extreme {
                    let end = (index + SATURATED_RUN).min(self.is_valid.len());
                    self.is_valid[index.saturating_sub(SATURATED_RUN)..end].fill(false);
                }
            }
        }
        self.saturated_share = saturated as f64 / self.force_n.len() as f64;
        if saturated > 0 {
            self.notes.push(format!(
                "the force stays at its extreme value for {saturated} samples ({:.1} %): saturated, and left out",
                100.0 * self.saturated_share
            ));
        }
    }

    /// Number of samples.
    pub(super) fn len(&self) -> usize {
        self.position_m.len()
    }

    /// The force that was recorded `shift_s` later than each sample, and by `growth_s` more at the last sample than at
    /// the first, by linear interpolation; the first and last one beyond the ends.
    pub(super) fn force_shifted(&self, shift_s: f64, growth_s: f64) -> Vec<f64> {
        let last = self.len() - 1;
        let (shift, growth) = (shift_s / self.period_s, growth_s / self.period_s);
        (0..self.len())
            .map(|index| {
                let place = index as f64 / last as f64 - 0.5;
                let at = (index as f64 + shift + growth * place).clamp(0.0, last as f64);
                let left = whole(at).min(last - 1);
                between(&self.force_n, (left, at - left as f64))
            })
            .collect()
    }
}

/// Whether a force is constant between switches, as a command of a relay is, or one that is held from one update to the
/// next: that it stays at its greatest value says nothing of a sensor's range.
fn is_stepwise(force_n: &[f64]) -> bool {
    let (least, greatest) = extent(force_n.iter().copied());
    let between: Vec<usize> = (1..force_n.len())
        .filter(|&at| force_n[at] != least && force_n[at] != greatest)
        .collect();
    let held = between.iter().filter(|&&at| force_n[at] == force_n[at - 1]).count();
    between.len() as f64 <= MIN_BETWEEN * force_n.len() as f64 || held as f64 > MAX_HELD * between.len() as f64
}

/// The times between samples without the gaps, s.
fn steps_without_gaps(t_s: &[f64]) -> impl Iterator<Item = f64> {
    let longest_s = gaps::longest_step_s(t_s);
    let steps = t_s.array_windows().map(|[before, after]| after - before);
    steps.filter(move |step_s| *step_s <= longest_s)
}

/// The mean time between samples without the gaps, s.
fn mean_period_s(t_s: &[f64]) -> f64 {
    let mut periods: Vec<f64> = steps_without_gaps(t_s).collect();
    periods.sort_unstable_by(f64::total_cmp);
    periods.iter().sum::<f64>() / periods.len() as f64
}

/// Lagrange's cubic through the samples around `left` and `left + 1`.
fn cubic(t: &[f64], x: &[f64], left: usize, at: f64) -> f64 {
    let first = left.saturating_sub(1).min(t.len() - 4);
    // From the value at `left`, so that a large position keeps its digits.
    let base = x[left];
    let value: f64 = (first..first + 4)
        .map(|i| {
            let weight: f64 = (first..first + 4)
                .filter(|j| *j != i)
                .map(|j| (at - t[j]) / (t[i] - t[j]))
                .product();
            weight * (x[i] - base)
        })
        .sum();
    base + value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(t_s: Vec<f64>) -> Record {
        Record {
            position_m: t_s.iter().map(|t| (3.0 * t).sin()).collect(),
            force_n: t_s.iter().map(|t| 2.0 * t).collect(),
            t_s,
            ..Record::default()
        }
    }

    #[test]
    fn uneven_times_are_put_on_an_even_grid_and_gaps_are_marked() {
        let t_s: Vec<f64> = (0..1000)
            .filter(|k| !(400..450).contains(k))
            .map(|k| 5.0 + 1e-3 * (f64::from(k) + 0.3 * f64::from(k * 7 % 11 - 5) / 5.0))
            .collect();
        let grid = Grid::new(&record(t_s));
        assert!((grid.period_s - 1e-3).abs() < 2e-6, "{}", grid.period_s);
        let mut gap = 0;
        for index in 0..grid.len() {
            let t = grid.start_s + index as f64 * grid.period_s;
            if grid.is_valid[index] {
                assert!((grid.position_m[index] - (3.0 * t).sin()).abs() < 1e-10, "{index}");
                assert!((grid.force_n[index] - 2.0 * t).abs() < 1e-9, "{index}");
            } else {
                gap += 1;
            }
        }
        assert!((48..=52).contains(&gap), "{gap}");
        assert!(grid.notes[0].contains("1 gaps"), "{:?}", grid.notes);
    }

    #[test]
    fn a_force_that_stays_at_its_extreme_is_saturated() {
        let mut clipped = record((0..1000).map(|k| f64::from(k) * 1e-3).collect());
        for force in &mut clipped.force_n {
            *force = force.min(1.9);
        }
        let grid = Grid::new(&clipped);
        assert!(!grid.is_valid[960] && grid.is_valid[900]);
        assert!((grid.saturated_share - 0.05).abs() < 0.003, "{}", grid.saturated_share);
    }

    #[test]
    fn a_force_that_only_switches_or_never_changes_is_not_saturated() {
        let of = |force: fn(i32) -> f64| {
            let mut switched = record((0..1000).map(|k| f64::from(k) * 1e-3).collect());
            switched.force_n = (0..1000).map(force).collect();
            Grid::new(&switched)
        };
        for force in [
            |k: i32| if k / 250 % 2 == 0 { 5.0 } else { -5.0 },
            |_: i32| 2.0,
            // One that is held for ten samples.
            |k: i32| f64::from(k / 10 * 7 % 13),
        ] {
            let grid = of(force);
            assert_eq!(grid.saturated_share, 0.0);
            assert!(
                grid.is_valid.iter().all(|valid| *valid) && grid.notes.is_empty(),
                "{:?}",
                grid.notes
            );
        }
    }

    #[test]
    fn a_shift_takes_the_force_from_later() {
        let grid = Grid::new(&record((0..100).map(|k| f64::from(k) * 1e-3).collect()));
        let shifted = grid.force_shifted(2.5e-3, 0.0);
        assert!((shifted[10] - 2.0 * 12.5e-3).abs() < 1e-12, "{}", shifted[10]);
    }
}
