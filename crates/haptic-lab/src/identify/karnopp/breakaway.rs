//! Static friction: the force at which a slow load sets a resting mass loose.

use super::motion::Motion;
use crate::identify::grid::Grid;
use crate::identify::smoothing::whole;

/// A load is slow when it takes at least so long to reach the breakaway, s. At a coupling of 25000 N/m and a
/// limit of 4 N that is a hand at 1.6 mm/s. A faster one goes on rising while the mass sets off:
/// at 100 mm/s a limit of 7 N reads as 14 N.
const SLOWEST_LOAD_S: f64 = 0.1;

/// The force is read off a line through at most so long before the breakaway, s.
const LONGEST_LINE_S: f64 = 0.1;

/// Largest part of the force by which it may rise while the instant is uncertain.
const LARGEST_RISE: f64 = 0.06;

/// The start is read off two distances, the farther one reached in so many times the time of the nearer one.
const FARTHER: f64 = 1.5;

/// A start takes at most so long from the one distance to the other, s.
const LONGEST_START_S: f64 = 0.1;

/// A breakaway from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Breakaway {
    /// 1 or -1.
    pub(super) sense: i8,
    /// Driving force, N.
    pub(super) force_n: f64,
    /// Standard error of the line there, N.
    pub(super) noise_n: f64,
    /// How much the force rises in the time by which the instant is uncertain, N.
    pub(super) rise_n: f64,
    /// How fast it rises, N/s.
    pub(super) rate_n_per_s: f64,
}

impl Breakaway {
    /// Whether its force is that of the surface, and not of the load's speed.
    pub(super) fn is_slow(&self) -> bool {
        let force = self.force_n.abs();
        self.rate_n_per_s.abs() * SLOWEST_LOAD_S <= force && self.rise_n <= LARGEST_RISE * force
    }
}

/// All breakaways of a record, in order. `force` is on the clock of the positions.
pub(super) fn find(grid: &Grid, motion: &Motion, force: &[f64]) -> Vec<Breakaway> {
    let found = motion.rests.iter().filter_map(|rest| {
        let x = &grid.position_m;
        // The last part of the rest may be its first motion.
        let quiet = rest.start + (rest.len() * 2 / 3).max(3);
        let rest_m = x[rest.start..quiet].iter().sum::<f64>() / (quiet - rest.start) as f64;
        let away = |threshold: f64| {
            let is_beyond = |at: &usize| (x[*at] - rest_m).abs() > threshold;
            let at = (quiet..x.len()).find(|at| (*at..(at + 3).min(x.len())).all(|next| is_beyond(&next)))?;
            Some((at, if x[at] > rest_m { 1_i8 } else { -1 }))
        };
        let threshold = 3.0 * motion.noise_m + 0.5 * motion.step_m;
        let (first, sense) = away(threshold)?;
        let (second, same) = away(FARTHER * FARTHER * threshold)?;
        // A load that lets go again, a creep, or a slip shorter than that.
        let rests_between =
            |other: &std::ops::Range<usize>| other.start > quiet && other.start < second && other.end > first;
        let longest = whole(LONGEST_START_S / grid.period_s);
        if same != sense || second > first + longest || motion.rests.iter().any(rests_between) {
            return None;
        }
        // It sets off along a parabola.
        let start = whole(((second - first) as f64 / (FARTHER - 1.0)).round());
        let onset = first.saturating_sub(start).max(quiet);
        let uncertain_s = ((first - onset) as f64 * 0.5 + 1.0) * grid.period_s;
        let length = whole(LONGEST_LINE_S / grid.period_s).min(onset - rest.start);
        let line = onset.checked_sub(length).filter(|_| length >= 8)?..onset;
        if !grid.is_valid[line.clone()].iter().all(|valid| *valid) {
            return None;
        }
        let (force_n, rate_per_sample, noise_n) = line_at_end(&force[line]);
        let rate_n_per_s = rate_per_sample / grid.period_s;
        let loads = rate_n_per_s * f64::from(sense) > 0.0 && force_n * f64::from(sense) > 0.0;
        loads.then_some(Breakaway {
            sense,
            force_n,
            noise_n,
            rise_n: rate_n_per_s.abs() * uncertain_s,
            rate_n_per_s,
        })
    });
    found.collect()
}

/// Value at the end, slope per sample and standard error of that value, of the straight line through the values.
fn line_at_end(values: &[f64]) -> (f64, f64, f64) {
    let n = values.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / n;
    let square = n * (n * n - 1.0) / 12.0;
    let slope = values
        .iter()
        .enumerate()
        .map(|(index, value)| (index as f64 - middle) * value)
        .sum::<f64>()
        / square;
    let left: f64 = values
        .iter()
        .enumerate()
        .map(|(index, value)| (value - mean - slope * (index as f64 - middle)).powi(2))
        .sum();
    let variance = left / (n - 2.0).max(1.0);
    let end = n - middle;
    (
        mean + slope * end,
        slope,
        (variance * (1.0 / n + end * end / square)).sqrt(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_carried_on_to_the_sample_behind_it() {
        let (value, slope, error) = line_at_end(&[1.0, 1.5, 2.0, 2.5]);
        assert!((value - 3.0).abs() < 1e-12 && (slope - 0.5).abs() < 1e-12 && error < 1e-9);
    }
}
