//! Where the mass slides, which way, and where it rests.

use crate::identify::grid::Grid;
use crate::smoothing::{Window, encoder_step, slope, slope_noise, white_noise, whole};
use crate::stats::mean::rms;
use haptic_motion::median::{at_share, extent, median};
use std::ops::Range;

/// Longest time over which velocity is taken as even, s.
const MAX_SLOPE_S: f64 = 20e-3;

/// Standard deviations of its velocity beyond which the direction of a motion is certain.
const CERTAIN_DEVIATIONS: f64 = 4.0;

/// Shortest rest, s.
const MIN_REST_S: f64 = 30e-3;

/// What the positions say about the motion.
#[derive(Clone, Debug)]
pub(in crate::identify) struct MotionEstimate {
    /// Velocity, m/s.
    pub(in crate::identify) velocity_mps: Vec<f64>,
    /// 1 and -1 where it slides for certain, else 0.
    pub(in crate::identify) sense: Vec<i8>,
    /// Where it stays within the noise, samples.
    pub(super) rests: Vec<Range<usize>>,
    /// Standard deviation of a position's noise, m; the encoder's rounding included.
    pub(super) noise_m: f64,
    /// Step of the encoder, m; 0 where none is seen.
    pub(super) step_m: f64,
    /// Slowest certain slide, m/s.
    pub(super) slowest_mps: f64,
}

impl MotionEstimate {
    pub(in crate::identify) fn new(grid: &Grid, resolution_m: Option<f64>) -> Self {
        let (x, period_s) = (&grid.position_m, grid.period_s);
        let step_m = resolution_m.or_else(|| encoder_step(x)).unwrap_or(0.0);
        let longest = whole(MAX_SLOPE_S / period_s).max(2);
        let rough = slope(x, longest, period_s);
        let fastest = rough.iter().fold(0.0_f64, |fastest, v| fastest.max(v.abs()));
        let moves: Vec<bool> = rough.iter().map(|v| v.abs() > 0.1 * fastest).collect();
        let noise_m = white_noise(x, &moves).max(step_m / 12.0_f64.sqrt());
        let usual = rms(rough.iter().copied());
        // The shortest slope whose noise leaves directions certain from a fiftieth of the usual velocity on.
        let reach = (2..longest)
            .find(|reach| CERTAIN_DEVIATIONS * noise_m * slope_noise(*reach, period_s) <= 0.02 * usual)
            .unwrap_or(longest);
        let velocity_mps = slope(x, reach, period_s);
        let slowest_mps = (CERTAIN_DEVIATIONS * noise_m * slope_noise(reach, period_s)).max(1e-9);
        let turn_m = CERTAIN_DEVIATIONS * noise_m;
        let longest_turn = whole(MAX_TURN_S / period_s);
        let mut sense = senses(&velocity_mps, slowest_mps, reach, |turn| {
            is_quick(x, turn, turn_m, longest_turn)
        });
        leave_out_creeping(&velocity_mps, &mut sense, whole(MAX_CREEP_S / period_s));
        let rests = rests(x, 8.0 * noise_m + 1.1 * step_m, whole(MIN_REST_S / period_s));
        Self {
            velocity_mps,
            sense,
            rests,
            noise_m,
            step_m,
            slowest_mps,
        }
    }

    /// Standard deviation of the noise of accelerations under a window, m/s^2.
    pub(super) fn acceleration_noise(&self, window: &Window) -> f64 {
        self.noise_m * window.curvature_noise()
    }

    /// Samples that slide in a direction.
    pub(super) fn sliding(&self, sense: i8) -> usize {
        self.sense.iter().filter(|each| **each == sense).count()
    }

    /// The median travel of a slide, m.
    pub(super) fn slide_m(&self, period_s: f64) -> f64 {
        let mut travels = Vec::new();
        let (mut travel_m, mut before) = (0.0, 0);
        for (sense, velocity) in self.sense.iter().zip(&self.velocity_mps) {
            if *sense != before {
                travels.extend((before != 0).then_some(travel_m));
                travel_m = 0.0;
            }
            travel_m += velocity.abs() * period_s;
            before = *sense;
        }
        median(&mut travels).unwrap_or(0.0)
    }

    /// Slides in a direction: runs of at least `shortest` samples.
    pub(super) fn slides(&self, sense: i8, shortest: usize) -> usize {
        self.sense
            .chunk_by(|a, b| a == b)
            .filter(|run| run[0] == sense && run.len() >= shortest)
            .count()
    }
}

/// Slower than this share of the fast slides for longer than this time, s, a motion may be made of slips and rests that
/// are too short to be seen.
const CREEP_SHARE: f64 = 0.05;
const MAX_CREEP_S: f64 = 0.1;

/// Leaves out where it creeps.
fn leave_out_creeping(velocity: &[f64], sense: &mut [i8], longest: usize) {
    let mut speeds: Vec<f64> = velocity.iter().map(|v| v.abs()).collect();
    let limit = CREEP_SHARE * at_share(&mut speeds, 19, 20).unwrap_or(0.0);
    let mut begin = 0;
    for run in velocity.chunk_by(|a, b| (a.abs() < limit) == (b.abs() < limit)) {
        if run[0].abs() < limit && run.len() > longest {
            sense[begin..begin + run.len()].fill(0);
        }
        begin += run.len();
    }
}

/// Longest time at a turn within the position's noise, s: so long a rest may be hidden there.
const MAX_TURN_S: f64 = 2.5e-3;

/// Whether a turn somewhere in `range` is seen to be one, and not a short rest: hardly a sample is as far as
/// the farthest.
fn is_quick(x: &[f64], range: Range<usize>, tolerance: f64, longest: usize) -> bool {
    let near = |extreme: f64| {
        x[range.clone()]
            .iter()
            .filter(|x| (**x - extreme).abs() <= tolerance)
            .count()
    };
    let (low, high) = extent(x[range.clone()].iter().copied());
    let is_high = x[range.start].max(x[range.end - 1]) < f64::midpoint(low, high);
    near(if is_high { high } else { low }) <= longest
}

/// The direction of each sample. A velocity that passes through zero in a quick turn turns in the middle of its
/// way; one that stays there may be stuck, and so may the samples that its slope reaches into.
fn senses(velocity: &[f64], slowest: f64, reach: usize, is_quick: impl Fn(Range<usize>) -> bool) -> Vec<i8> {
    let mut sense: Vec<i8> = velocity
        .iter()
        .map(|v| i8::from(*v > slowest) - i8::from(*v < -slowest))
        .collect();
    let mut begin = 1;
    while begin < sense.len() {
        let is_turn = sense[begin] * sense[begin - 1] == -1;
        if sense[begin] != 0 && !is_turn {
            begin += 1;
            continue;
        }
        let slow = sense[begin..].iter().position(|each| *each != 0);
        let end = slow.map_or(sense.len(), |length| begin + length);
        let (before, after) = (sense[begin - 1], sense.get(end).copied().unwrap_or(0));
        let around = begin.saturating_sub(reach)..(end + reach).min(sense.len());
        if end - begin <= reach && before * after == -1 && is_quick(around) {
            let middle = usize::midpoint(begin, end);
            sense[begin..middle].fill(before);
            sense[middle..end].fill(after);
            begin = end + 1;
        } else {
            // A slope that reaches into a rest is slower than the motion, and one that reaches out of it faster.
            let last = (end + 2 * reach).min(sense.len());
            sense[begin.saturating_sub(2 * reach)..last].fill(0);
            begin = last + 1;
        }
    }
    if sense.first() == Some(&0) {
        let length = sense.iter().position(|each| *each != 0).unwrap_or(sense.len());
        let last = (length + 2 * reach).min(sense.len());
        sense[..last].fill(0);
    }
    sense
}

/// Runs of positions within `tolerance` of each other.
fn rests(x: &[f64], tolerance: f64, shortest: usize) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut begin = 0;
    while begin < x.len() {
        let (mut low, mut high) = (x[begin], x[begin]);
        let mut end = begin + 1;
        while end < x.len() && high.max(x[end]) - low.min(x[end]) <= tolerance {
            low = low.min(x[end]);
            high = high.max(x[end]);
            end += 1;
        }
        if end - begin >= shortest.max(4) {
            found.push(begin..end);
            begin = end;
        } else {
            begin += 1 + (end - begin) / 8;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_passed_and_a_rest_is_left_out() {
        let turn: Vec<f64> = (-20..20).map(|k| 0.01 * f64::from(k)).collect();
        let sense = senses(&turn, 0.015, 3, |_| true);
        assert_eq!((sense[19], sense[21]), (-1, 1));
        assert!(sense.iter().all(|each| *each != 0));
        let mut stop = vec![0.1; 10];
        stop.extend([0.0; 8]);
        stop.extend([-0.1; 10]);
        let sense = senses(&stop, 0.015, 3, |_| true);
        assert_eq!(&sense[2..6], &[1, 1, 0, 0]);
        assert_eq!(&sense[22..26], &[0, 0, -1, -1]);
        // A turn without a slow sample may hide a rest as well.
        let sense = senses(&[[0.1; 20], [-0.1; 20]].concat(), 0.015, 3, |_| false);
        assert_eq!(&sense[12..28], &[1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1, -1]);
    }

    #[test]
    fn rests_are_where_the_position_stays() {
        let x: Vec<f64> = (0..300)
            .map(|k| 1e-3 * f64::from((k - 100_i32).clamp(0, 100)) + 1e-6 * f64::from(k % 3))
            .collect();
        assert_eq!(rests(&x, 5e-6, 30), [0..101, 200..300]);
    }
}
