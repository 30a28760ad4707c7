//! A record on an even clock, and the path that its encoder's steps show.

use super::super::grid::Even;
use super::super::options::Record;
use super::adaptive::Windows;
use crate::smoothing::white_noise;

/// Fewest samples in which anything can be found.
const MIN_SAMPLES: usize = 200;
/// A record on an even clock.
#[derive(Clone, Debug)]
pub(in crate::identify) struct Path {
    /// Time between two samples, s.
    pub(crate) period_s: f64,
    /// Positions as counted, m.
    pub(crate) counted_m: Vec<f64>,
    /// Force that drives the mass, N.
    pub(crate) force_n: Vec<f64>,
    /// The path without the encoder's steps, m.
    pub(crate) smooth_m: Vec<f64>,
    /// Where the path turns on its way to each sample, m; the sample itself where it does not.
    pub(crate) via_m: Vec<f64>,
    /// Velocity, m/s.
    pub(crate) speed_mps: Vec<f64>,
    /// Whether the samples about here are there, and the force is within the sensor's range.
    pub(crate) is_recorded: Vec<bool>,
    /// What is worth a remark: gaps, jitter, saturation.
    pub(crate) notes: Vec<String>,
    /// Step of the encoder, m; 0 where none shows.
    pub(crate) resolution_m: f64,
    windows: Windows,
}

impl Path {
    /// `None` where there are too few samples. The force's clock is `shift_s` ahead.
    pub(in crate::identify) fn new(even: &Even, shift_s: f64) -> Option<Self> {
        if even.samples < MIN_SAMPLES {
            return None;
        }
        let (grid, step) = (&even.grid, even.step_m.unwrap_or(0.0));
        let white = white_noise(&grid.position_m, &grid.is_valid);
        // The steps alone make noise of up to step^2/12.
        let noise = (white * white - step * step / 6.0).max(0.0).sqrt();
        let windows = Windows::new(&grid.position_m, grid.period_s, step, noise.max(1e-12));
        let path = Self {
            period_s: grid.period_s,
            force_n: grid.force_shifted(shift_s, 0.0),
            counted_m: grid.position_m.clone(),
            smooth_m: Vec::new(),
            via_m: Vec::new(),
            speed_mps: Vec::new(),
            is_recorded: grid.is_valid.clone(),
            notes: grid.notes.clone(),
            resolution_m: step,
            windows,
        };
        Some(path.smoothed())
    }

    /// The same motion with other counts and forces.
    pub(crate) fn drawn_again(&self, record: &Record) -> Self {
        let path = Self {
            windows: self.windows.chosen_again(&record.position_m),
            counted_m: record.position_m.clone(),
            force_n: record.force_n.clone(),
            ..self.clone()
        };
        path.smoothed()
    }

    fn smoothed(mut self) -> Self {
        (self.smooth_m, self.speed_mps) = self.windows.smooth(&self.counted_m);
        for speed in &mut self.speed_mps {
            *speed /= self.period_s;
        }
        self.via_m = turning_points(&self.smooth_m);
        self
    }

    /// How fast the force changes, N/s.
    pub(crate) fn force_rates(&self) -> Vec<f64> {
        let last = self.force_n.len() - 1;
        let between =
            |from: usize, to: usize| (self.force_n[to] - self.force_n[from]) / ((to - from) as f64 * self.period_s);
        (0..=last)
            .map(|at| between(at.saturating_sub(1), (at + 1).min(last)))
            .collect()
    }

    /// Acceleration of the smooth path, m/s^2.
    pub(crate) fn accelerations(&self) -> Vec<f64> {
        let x = &self.smooth_m;
        let inner = x
            .windows(3)
            .map(|three| (three[2] - 2.0 * three[1] + three[0]) / (self.period_s * self.period_s));
        std::iter::once(0.0).chain(inner).chain(std::iter::once(0.0)).collect()
    }

    /// The samples at which the motion turns and then goes back by more than a distance, m.
    pub(crate) fn turns(&self, least_m: f64) -> Vec<usize> {
        let mut turns = Vec::new();
        // The farthest sample since the last turn, and the direction to it from there.
        let (mut farthest, mut direction) = (0, 0.0);
        for (sample, position) in self.smooth_m.iter().enumerate() {
            let moved = position - self.smooth_m[farthest];
            if direction == 0.0 {
                if moved.abs() > least_m {
                    (farthest, direction) = (sample, moved.signum());
                }
            } else if direction * moved > 0.0 {
                farthest = sample;
            } else if moved.abs() > least_m {
                turns.push(farthest);
                (farthest, direction) = (sample, -direction);
            }
        }
        turns
    }

    /// The greatest distance that was gone in one direction, m, with turns of a least distance, m.
    pub(crate) fn longest_stroke(&self, least_m: f64) -> f64 {
        let turns = self.turns(least_m);
        let ends: Vec<usize> = std::iter::once(0)
            .chain(turns)
            .chain([self.smooth_m.len() - 1])
            .collect();
        let strokes = ends
            .windows(2)
            .map(|ends| (self.smooth_m[ends[1]] - self.smooth_m[ends[0]]).abs());
        strokes.fold(0.0, f64::max)
    }
}

/// Where a path turns on its way to each position, by the parabola through the three about the farthest; the position
/// itself where it does not turn.
fn turning_points(positions_m: &[f64]) -> Vec<f64> {
    let mut via = positions_m.to_vec();
    for at in 1..positions_m.len().saturating_sub(1) {
        let (before, after) = (
            positions_m[at] - positions_m[at - 1],
            positions_m[at + 1] - positions_m[at],
        );
        if before * after < 0.0 {
            let (slope, bend) = (0.5 * (before + after), after - before);
            let turn = positions_m[at] - 0.5 * slope * slope / bend;
            // Before the farthest sample where the path already comes back there.
            via[if slope * before < 0.0 { at } else { at + 1 }] = turn;
        }
    }
    via
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(position: impl Fn(f64) -> f64, samples: u32) -> Even {
        let t_s: Vec<f64> = (0..samples).map(|k| f64::from(k) * 1e-3).collect();
        Even::new(&Record {
            position_m: t_s.iter().map(|&t| position(t)).collect(),
            force_n: vec![0.0; t_s.len()],
            t_s,
            ..Record::default()
        })
    }

    #[test]
    fn a_turn_between_samples_is_found() {
        for share in [0.2, 0.4, 0.7] {
            let positions: Vec<f64> = (0..7).map(|k| 1.0 - (f64::from(k) - 3.0 - share).powi(2)).collect();
            let via = turning_points(&positions);
            assert!((via[4] - 1.0).abs() < 1e-12, "{via:?}");
            assert!((0..7).filter(|&k| k != 4).all(|k| via[k] == positions[k]), "{via:?}");
        }
    }

    #[test]
    fn turns_are_where_the_motion_goes_back() {
        let path =
            Path::new(&even(|t| 0.5e-3 * (1.0 - (t * std::f64::consts::TAU).cos()), 3251), 0.0).expect("long enough");
        assert_eq!(path.turns(1e-5), [500, 1000, 1500, 2000, 2500, 3000]);
        assert!((path.longest_stroke(1e-5) - 1e-3).abs() < 1e-6);
    }
}
