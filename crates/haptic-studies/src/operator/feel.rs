//! A simulated operator at the perception tests: strokes to and fro, and of each surface two forces that are felt,
//! the breakaway and the friction of the slide. Each is felt with noise in proportion to it (Weber's law).
//!
//! The two are weighed as an observer does who has learned in the trials which of them the test changes: each by the
//! change that is expected of it over the variance of its difference. Of independent noises that is the best linear
//! weighting, and then `d'^2 = d1^2 + d2^2` ("A tutorial on cue combination and signal detection theory",
//! doi:10.1016/j.jmp.2016.04.006); a force that the test leaves alone has no weight.

use super::arm::Arm;
use super::constants::Constants;
use super::rig::{Load, PERIOD_S, Rig};
use crate::perception::Answer;
use crate::random::Random;
use crate::trial::Case;
use haptic_ipc::Sample;

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

    /// The force on the handle in the next tick, N; the hand rests where there is nothing to feel.
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

    /// Which surface had more friction, in a test of a case.
    pub(super) fn answer(&mut self, constants: &Constants, case: Case, [first, second]: [Sensation; 2]) -> Answer {
        if judge(constants, case, first.forces_n(), second.forces_n(), &mut self.random) > 0.0 {
            Answer::First
        } else {
            Answer::Second
        }
    }
}

/// Evidence that the first of two surfaces had more friction, from their breakaway and sliding friction, N.
fn judge(
    constants: &Constants,
    case: Case,
    (first_static_n, first_dynamic_n): (f64, f64),
    (second_static_n, second_dynamic_n): (f64, f64),
    random: &mut Random,
) -> f64 {
    // Change of each force that is expected, as a share of the level.
    let (static_change, dynamic_change) = match case {
        Case::A | Case::C => (1.0, 1.0),
        Case::B => (1.0, 0.0),
    };
    let mut evidence = |change: f64, first_n: f64, second_n: f64, noise: f64| {
        let (first_noise, second_noise) = (random.normal(), random.normal());
        let difference_n = first_n * (1.0 + noise * first_noise) - second_n * (1.0 + noise * second_noise);
        let variance_n2 = noise * noise * (first_n * first_n + second_n * second_n);
        // Without noise or force a cue is as good as certain, or nothing.
        change * difference_n / variance_n2.max(1e-12)
    };
    evidence(
        static_change,
        first_static_n,
        second_static_n,
        constants.breakaway_noise,
    ) + evidence(
        dynamic_change,
        first_dynamic_n,
        second_dynamic_n,
        constants.sliding_noise,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Purpose;
    use statrs::distribution::{ContinuousCDF, Normal};

    /// Shares of right answers are those of `d'^2 = d1^2 + d2^2`, and of the breakaway alone where it alone changes.
    #[test]
    fn both_changes_tell_more_than_one_and_a_force_that_stays_tells_nothing() {
        let constants = Constants::default();
        let mut random = Random::new(1, 1, Purpose::Noise, 0);
        let of_cue = |base_n: f64, change_n: f64, noise: f64| {
            let other_n = base_n + change_n;
            change_n / (noise * (base_n * base_n + other_n * other_n).sqrt())
        };
        let (base, level_n) = ((4.0, 3.5), 0.4);
        let in_breakaway = of_cue(base.0, level_n, constants.breakaway_noise);
        let in_slide = of_cue(base.1, level_n, constants.sliding_noise);
        let standard = Normal::standard();
        for (case, comparison, sensitivity) in [
            (Case::A, (4.4, 3.9), in_breakaway.hypot(in_slide)),
            (Case::B, (4.4, 3.5), in_breakaway),
        ] {
            const TRIALS: u32 = 20_000;
            let right = (0..TRIALS).filter(|_| judge(&constants, case, comparison, base, &mut random) > 0.0);
            let (share, expected) = (right.count() as f64 / f64::from(TRIALS), standard.cdf(sensitivity));
            // Four standard errors.
            let tolerance = 4.0 * (expected * (1.0 - expected) / f64::from(TRIALS)).sqrt();
            assert!((share - expected).abs() < tolerance, "{case:?}: {share}, {expected}");
        }
    }
}
