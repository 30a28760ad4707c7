//! A simulated subject at the perception tests: strokes to and fro, and of each surface two forces that are felt, the
//! breakaway and the friction of the slide, each with noise in proportion to it (Weber's law). Their relative
//! differences are added; no more is claimed of it.

use super::hand::Hand;
use super::rig::{PERIOD_S, Rig};
use crate::perception::Answer;
use crate::random::Random;
use haptic_ipc::Sample;

/// Deviation of a breakaway and of a sliding friction that is felt, as a share of it: a constant force of 2.5 to 10 N
/// is distinguished by 7 % (Pang, Tan and Durlach 1991, abstract); that a breakaway, which lasts some milliseconds, is
/// felt less well is ours.
const BREAKAWAY_NOISE: f64 = 0.2;
const SLIDING_NOISE: f64 = 0.07;

/// Half of a stroke, m, and the times of a stroke and of the rest after it, s: ours.
const HALF_STROKE_M: f64 = 0.02;
const STROKE_S: f64 = 0.6;
const REST_S: f64 = 0.15;

/// Speed of the block from which on a slide is felt as one, m/s: ours.
const SLIDE_MPS: f64 = 0.02;

/// What is felt of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensation {
    /// Largest force of the stroke under way, N.
    peak_n: f64,
    /// Largest force of all strokes, N.
    largest_n: f64,
    was_sliding: bool,
    breakaways: f64,
    breakaway_sum_n: f64,
    slide_ticks: f64,
    slide_sum_n: f64,
}

impl Sensation {
    /// Feels a tick.
    pub(super) fn feel(&mut self, row: &Sample) {
        let force_n = row.command_force_n.abs();
        self.largest_n = self.largest_n.max(force_n);
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

    /// Breakaway and sliding friction, N, on the average. A surface that never gave way is felt by the largest force
    /// that it held.
    pub(super) fn forces_n(&self) -> (f64, f64) {
        let mean = |sum_n: f64, count: f64| if count > 0.0 { sum_n / count } else { self.largest_n };
        (
            mean(self.breakaway_sum_n, self.breakaways),
            mean(self.slide_sum_n, self.slide_ticks),
        )
    }
}

/// Strokes to and fro.
#[derive(Debug)]
pub(super) struct Strokes {
    hand: Hand,
    random: Random,
    side: f64,
    rest_s: f64,
}

impl Strokes {
    pub(super) fn new(random: Random) -> Self {
        Self {
            hand: Hand::at(0.0),
            random,
            side: 1.0,
            rest_s: 0.0,
        }
    }

    /// The force on the handle in the next tick, N; the hand rests where there is nothing to feel.
    pub(super) fn force_n(&mut self, rig: &Rig, is_felt: bool) -> f64 {
        if self.hand.is_at_rest() {
            self.rest_s += PERIOD_S;
            if is_felt && self.rest_s >= REST_S {
                self.rest_s = 0.0;
                self.hand.move_to(self.side * HALF_STROKE_M, STROKE_S);
                self.side = -self.side;
            }
        }
        self.hand.force_n(rig)
    }

    /// Which surface had more friction.
    pub(super) fn answer(&mut self, [first, second]: [Sensation; 2]) -> Answer {
        let (first, second) = (first.forces_n(), second.forces_n());
        let mut evidence = |first_n: f64, second_n: f64, noise: f64| {
            let felt_n = |force_n: f64, deviation: f64| force_n * (1.0 + noise * deviation);
            let difference_n = felt_n(first_n, self.random.normal()) - felt_n(second_n, self.random.normal());
            difference_n / (noise * first_n.max(second_n)).max(1e-6)
        };
        let evidence = evidence(first.0, second.0, BREAKAWAY_NOISE) + evidence(first.1, second.1, SLIDING_NOISE);
        if evidence > 0.0 { Answer::First } else { Answer::Second }
    }
}
