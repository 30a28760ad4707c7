//! A simulated subject at the targeting task: looks, moves, looks again, and clicks once the cursor is inside.

use super::hand::Hand;
use super::rig::{PERIOD_S, Rig};
use crate::fitts::Targets;
use crate::plan::RigMapping;
use crate::random::Random;

/// Time from something that is seen to a movement that follows from it, s: 130 to 200 ms in distance (Saunders and
/// Knill 2005, abstract).
const DELAY_S: f64 = 0.15;

/// Deviation of a movement's end for each m/s of its mean speed, s: that it grows so is of Meyer and others 1988
/// (abstract), the value is ours.
const ENDPOINT_NOISE_S: f64 = 0.03;

/// Share of the distance to a target's edge within which the cursor is seen to be inside: ours.
const SURELY_INSIDE: f64 = 0.9;

/// Duration of the fastest and the slowest movement, s: ours.
const MIN_S: f64 = 0.25;
const MAX_S: f64 = 0.8;

/// A subject at the targeting task.
#[derive(Debug)]
pub(super) struct Reach {
    mapping: RigMapping,
    hand: Hand,
    random: Random,
    /// Centre of the target that was seen last, m of the task.
    target_m: Option<f64>,
    /// Time until what is seen makes a difference, s.
    looks_s: f64,
}

impl Reach {
    /// One who holds the handle at a position of the rig, m.
    pub(super) fn new(mapping: RigMapping, at_m: f64, random: Random) -> Self {
        Self {
            mapping,
            hand: Hand::at(at_m),
            random,
            target_m: None,
            looks_s: DELAY_S,
        }
    }

    /// The force on the handle in the next tick, N, and whether there is a click.
    pub(super) fn tick(&mut self, rig: &Rig, targets: Option<Targets>) -> (f64, bool) {
        let target_m = targets.map(|targets| targets.active_m);
        if target_m != self.target_m {
            self.target_m = target_m;
            self.looks_s = DELAY_S;
        }
        let clicked = self.hand.is_at_rest() && targets.is_some_and(|targets| self.decide(rig, &targets));
        (self.hand.force_n(rig), clicked)
    }

    /// Decides what to do; whether that is a click.
    fn decide(&mut self, rig: &Rig, targets: &Targets) -> bool {
        self.looks_s -= PERIOD_S;
        if self.looks_s > 0.0 {
            return false;
        }
        self.looks_s = DELAY_S;
        let distance_m = targets.active_m - self.mapping.task_m(rig.position_m());
        let margin_m = 0.5 * (targets.width_m - targets.cursor_diameter_m);
        if distance_m.abs() <= SURELY_INSIDE * margin_m {
            return true;
        }
        // In this time one deviation of the end is the margin.
        let duration_s = (ENDPOINT_NOISE_S * distance_m.abs() / margin_m).clamp(MIN_S, MAX_S);
        let moved_m = distance_m * (1.0 + ENDPOINT_NOISE_S / duration_s * self.random.normal());
        self.hand
            .move_to(self.hand.goal_m() + moved_m / self.mapping.gain, duration_s);
        false
    }
}
