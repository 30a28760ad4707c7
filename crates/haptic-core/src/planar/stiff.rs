//! A slow slide, whose direction follows the pull at once.
//!
//! A slide turns towards its pull within `M s / R`. Where that is short beside the tick a power series would have to
//! resolve it, hundreds of times. Instead the direction `e` of the slide is a polynomial that satisfies the equation of
//! motion at five Radau nodes (Radau IIA of order nine; Hairer and Wanner 1996, chapter IV.5), and the linear part is
//! solved to rounding. The unknowns are speed and angle at each node: in them the equation stays mild however small the
//! speed is. A step counts when two of half its length end alike.

use super::series::{PieceMotion, Pull, Sliding, TOLERANCE_N, Vectors};
use super::vector::Plane;
use crate::math::sqrt;
use crate::series::{RECIPROCAL, ROOM, value};

const STAGES: usize = 5;

/// Radau's nodes.
const NODES: [f64; STAGES] = [
    0.057_104_196_114_517_68,
    0.276_843_013_638_123_8,
    0.583_590_432_368_916_8,
    0.860_240_135_656_219_5,
    1.0,
];

/// Coefficients, by power of time, of the polynomials that are 1 at one node and 0 at the others.
const OF_NODES: [[f64; STAGES]; STAGES] = [
    [
        1.586_407_900_186_328_2,
        -1.008_117_881_498_373,
        0.730_974_866_159_787_5,
        -0.509_264_884_847_742_7,
        0.2,
    ],
    [
        -11.879_263_560_593_57,
        21.561_468_539_410_11,
        -17.021_823_932_825_57,
        12.139_618_954_009_025,
        -4.8,
    ],
    [
        29.933_327_727_047_9,
        -73.334_306_169_638_13,
        80.478_815_606_138_43,
        -62.277_837_163_548_203,
        25.2,
    ],
    [
        -31.054_881_095_723_056,
        87.946_344_956_204_2,
        -117.938_298_751_790_83,
        105.846_834_891_309_69,
        -44.8,
    ],
    [
        11.414_409_029_082_395,
        -35.165_389_444_477_81,
        53.750_332_212_318_185,
        -55.199_351_796_922_77,
        25.2,
    ],
];

/// Newton steps after which a step is given up.
const MAX_NEWTON: u32 = 12;

/// Turns of the free block, rad, or time constants of its damping, that a step may cover: its linear part is a series.
const MAX_PHASE: f64 = 1.0;

/// By so much, rad, a slide may be turned against where the polynomial begins, however slow it is: the law decides at
/// zero speed whether one that turns round sticks.
const MAX_TURN: f64 = 0.1;

/// By so much, N, two half steps may differ from the whole, of an order that leaves them far more accurate.
const MAX_DIFFERENCE_N: f64 = 100.0 * TOLERANCE_N;

impl Sliding {
    /// Longest step, s, whose linear part converges.
    pub(super) fn longest_stiff_step(&self) -> f64 {
        let swings = sqrt(self.stiffness / self.mass);
        MAX_PHASE / swings.max(self.damping / self.mass)
    }

    /// The slide that goes on with `velocity` for `step_s`, in two halves; `None` where it is not so smooth.
    pub(super) fn follows_pull(&self, velocity: Plane, pull: &Pull, step_s: f64) -> Option<[PieceMotion; 2]> {
        let whole = self.collocated(velocity, pull, step_s)?;
        let first = self.collocated(velocity, pull, 0.5 * step_s)?;
        let moved = first.displacement(1.0);
        let middle = Pull {
            force: pull.force + pull.slope * (0.5 * step_s) - moved * self.stiffness,
            slope: pull.slope,
        };
        let second = self.collocated(first.velocity(1.0), &middle, 0.5 * step_s)?;
        let apart = (whole.displacement(1.0) - moved - second.displacement(1.0)) * self.stiffness;
        let faster = (whole.velocity(1.0) - second.velocity(1.0)) * self.impedance;
        (apart.sum() + faster.sum() <= MAX_DIFFERENCE_N).then_some([first, second])
    }

    fn collocated(&self, velocity: Plane, pull: &Pull, step_s: f64) -> Option<PieceMotion> {
        let scales = self.scales(step_s);
        // A velocity's series under a force that acts on it alone.
        let driven = |first: f64, force: &[f64]| {
            let mut series = [0.0; ROOM];
            series[0] = first;
            for k in 0..ROOM - 1 {
                let back = if k == 0 {
                    0.0
                } else {
                    scales.sprung * RECIPROCAL[k] * series[k - 1]
                };
                series[k + 1] =
                    (force.get(k).copied().unwrap_or(0.0) - scales.damped * series[k] - back) * RECIPROCAL[k + 1];
            }
            series
        };
        let free_x = driven(velocity.x, &[scales.share * pull.force.x, scales.slope * pull.slope.x]);
        let free_y = driven(velocity.y, &[scales.share * pull.force.y, scales.slope * pull.slope.y]);
        let free: Vectors = core::array::from_fn(|k| Plane::new(free_x[k], free_y[k]));
        let mut braked = [[0.0; ROOM]; STAGES];
        for (power, braked) in braked.iter_mut().enumerate() {
            let mut force = [0.0; STAGES];
            force[power] = scales.rubbed;
            *braked = driven(0.0, &force);
        }
        let mut weights = [[0.0; STAGES]; STAGES];
        for (at, weights) in NODES.iter().zip(&mut weights) {
            let values: [f64; STAGES] = core::array::from_fn(|power| value(&braked[power], *at));
            *weights = core::array::from_fn(|j| (0..STAGES).map(|m| values[m] * OF_NODES[m][j]).sum());
        }
        let free_at: [Plane; STAGES] = NODES.map(|node| value(&free, node));
        let before = velocity.length();
        let mut speeds = [before; STAGES];
        let mut directions: [Plane; STAGES] = core::array::from_fn(|i| {
            let there = pull.force + pull.slope * (NODES[i] * step_s);
            there * (1.0 / there.length())
        });
        let close = 1e-3 * TOLERANCE_N / self.impedance + 4.0 * f64::EPSILON * (before + scales.rubbed);
        let mut settled = false;
        for _ in 0..MAX_NEWTON {
            let rest: [Plane; STAGES] = core::array::from_fn(|i| {
                let mut rest = directions[i] * speeds[i] - free_at[i];
                for (weight, direction) in weights[i].iter().zip(&directions) {
                    rest += *direction * *weight;
                }
                rest
            });
            let far = rest.iter().fold(0.0, |far: f64, rest| far.max(rest.sum()));
            if !far.is_finite() {
                return None;
            }
            if settled && far <= close {
                break;
            }
            settled = far <= close;
            // Turns of the directions from the parts across them, then the speeds from those along.
            let mut matrix = [[0.0; STAGES]; STAGES];
            let mut turns: [f64; STAGES] = core::array::from_fn(|i| -directions[i].cross(rest[i]));
            for i in 0..STAGES {
                for j in 0..STAGES {
                    matrix[i][j] = weights[i][j] * directions[i].dot(directions[j]);
                }
                matrix[i][i] += speeds[i];
            }
            solve(&mut matrix, &mut turns)?;
            for i in 0..STAGES {
                let mut change = -directions[i].dot(rest[i]);
                for j in 0..STAGES {
                    change -= weights[i][j] * turns[j] * directions[j].cross(directions[i]);
                }
                speeds[i] += change;
            }
            for (direction, turn) in directions.iter_mut().zip(&turns) {
                let turned = *direction + direction.turned_left() * turn.clamp(-1.0, 1.0);
                *direction = turned * (1.0 / turned.length());
            }
        }
        if !settled || speeds.iter().any(|speed| *speed <= 0.1 * before) {
            return None;
        }
        // A slide that does not point where the polynomial begins is still turning.
        let mut begins = Plane::ZERO;
        for (direction, weight) in directions.iter().zip(&OF_NODES[0]) {
            begins += *direction * *weight;
        }
        let turning = (begins * before - velocity).sum();
        if turning * self.impedance > MAX_DIFFERENCE_N || turning > MAX_TURN * before {
            return None;
        }
        let mut motion = PieceMotion::at_rest(step_s);
        motion.velocity = free;
        for (power, braked) in braked.iter().enumerate() {
            let mut direction = Plane::ZERO;
            for (j, of_node) in directions.iter().enumerate() {
                direction += *of_node * OF_NODES[power][j];
                motion.speed[power] += speeds[j] * OF_NODES[power][j];
            }
            for (velocity, braked) in motion.velocity.iter_mut().zip(braked) {
                *velocity = *velocity - direction * *braked;
            }
        }
        Some(motion)
    }
}

/// Solves a linear system by elimination with pivots; `None` where it is singular.
fn solve(matrix: &mut [[f64; STAGES]; STAGES], right: &mut [f64; STAGES]) -> Option<()> {
    for column in 0..STAGES {
        let pivot = (column..STAGES).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))?;
        if matrix[pivot][column] == 0.0 {
            return None;
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..STAGES {
            let factor = matrix[row][column] / matrix[column][column];
            let of_pivot = matrix[column];
            for (cell, of_pivot) in matrix[row].iter_mut().zip(of_pivot).skip(column) {
                *cell -= factor * of_pivot;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..STAGES).rev() {
        for k in row + 1..STAGES {
            right[row] -= matrix[row][k] * right[k];
        }
        right[row] /= matrix[row][row];
    }
    Some(())
}
