//! A simulated operator at the perception tests: strokes to and fro, and of each surface two forces that are felt,
//! the breakaway and the friction of the slide. Each is felt with noise in proportion to it (Weber's law); they are
//! weighed by how exact they are.

use super::arm::Arm;
use super::constants::Constants;
use super::rig::{Load, PERIOD_S, Rig};
use crate::studies::perception::Answer;
use crate::studies::random::Random;
use haptic_ipc::Sample;

/// Half of a stroke, m, and the times of a stroke and of the rest after it, s: ours.
const HALF_STROKE_M: f64 = 0.02;
const STROKE_S: f64 = 0.6;
const REST_S: f64 = 0.15;

/// Speed of the block from which on a slide is felt as one, m/s: ours.
const SLIDE_MPS: f64 = 0.02;

/// What is felt of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Felt {
    /// Largest force of the stroke under way, N.
    peak_n: f64,
    was_sliding: bool,
    breakaways: f64,
    breakaway_sum_n: f64,
    slide_ticks: f64,
    slide_sum_n: f64,
}

impl Felt {
    /// Feels a tick.
    pub(super) fn feel(&mut self, row: &Sample) {
        let force_n = row.command_force_n.abs();
        let is_sliding = row.contact != 0;
        if is_sliding && !self.was_sliding {
            self.breakaways += 1.0;
            self.breakaway_sum_n += self.peak_n.max(force_n);
        }
        self.peak_n = if is_sliding { 0.0 } else { self.peak_n.max(force_n) };
        self.was_sliding = is_sliding;
        if is_sliding && row.block_velocity_mps.abs() > SLIDE_MPS {
            self.slide_ticks += 1.0;
            self.slide_sum_n += force_n;
        }
    }

    /// Breakaway and sliding friction, N, on the average.
    pub(super) fn forces_n(&self) -> (f64, f64) {
        (
            self.breakaway_sum_n / self.breakaways.max(1.0),
            self.slide_sum_n / self.slide_ticks.max(1.0),
        )
    }
}

/// Strokes to and fro.
#[derive(Debug)]
pub(super) struct Strokes {
    arm: Arm,
    random: Random,
    side: f64,
    rest_s: f64,
}

impl Strokes {
    pub(super) fn new(constants: &Constants, resistance: Load, random: Random) -> Self {
        Self {
            arm: Arm::new(constants, resistance, 0.0),
            random,
            side: 1.0,
            rest_s: 0.0,
        }
    }

    /// The force on the handle in the next tick, N; the hand rests where nothing is to be felt.
    pub(super) fn force_n(&mut self, rig: &Rig, is_felt: bool) -> f64 {
        if self.arm.is_over() {
            self.rest_s += PERIOD_S;
            if is_felt && self.rest_s >= REST_S {
                self.rest_s = 0.0;
                self.arm.move_to(self.side * HALF_STROKE_M, STROKE_S);
                self.side = -self.side;
            }
        }
        self.arm.force_n(rig, &mut self.random)
    }

    /// Which surface had more friction.
    pub(super) fn answer(&mut self, constants: &Constants, [first, second]: [Felt; 2]) -> Answer {
        let (first, second) = (first.forces_n(), second.forces_n());
        let random = &mut self.random;
        let mut cue = |first_n: f64, second_n: f64, noise: f64| {
            let (first_noise, second_noise) = (random.normal(), random.normal());
            let difference_n = first_n * (1.0 + noise * first_noise) - second_n * (1.0 + noise * second_noise);
            let deviation_n = noise * 0.5 * (first_n + second_n);
            // Without noise or force a cue is as good as certain, or nothing.
            difference_n / (deviation_n * deviation_n).max(1e-12)
        };
        let sum = cue(first.0, second.0, constants.breakaway_noise) + cue(first.1, second.1, constants.sliding_noise);
        if sum > 0.0 { Answer::First } else { Answer::Second }
    }
}
