//! A simulated operator at the targeting task.
//!
//! A primary movement, then a limited number of corrections of what is seen after the visual delay, then a click
//! (Meyer and others 1988, "Optimality in human motor performance"). The slower a movement, the less its end varies;
//! the operator takes the time in which most ends lie within the target.

use super::arm::Arm;
use super::constants::Constants;
use super::rig::{Load, PERIOD_S, Rig};
use crate::fitts::View;
use crate::plan::RigMapping;
use crate::random::Random;
use std::collections::VecDeque;

/// Phase of a movement.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Looks at what there is, for this number of further ticks.
    Looking(u32),
    /// Moves.
    Moving {
        /// Whether the end is so likely inside that a click follows at once.
        sure: bool,
    },
}

/// An operator at the targeting task.
#[derive(Debug)]
pub(super) struct Reach {
    constants: Constants,
    mapping: RigMapping,
    arm: Arm,
    random: Random,
    /// Positions on the screen that are not seen yet, m of the task; the first is seen next.
    unseen: VecDeque<f64>,
    target_m: Option<f64>,
    phase: Phase,
    corrections: f64,
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a thousand ticks, and the cast saturates"
)]
fn ticks(seconds: f64) -> u32 {
    (seconds / PERIOD_S).round() as u32
}

impl Reach {
    /// One who holds the handle at a position of the rig, m.
    pub(super) fn new(constants: &Constants, mapping: RigMapping, resistance: Load, at_m: f64, random: Random) -> Self {
        let delay_ticks = ticks(constants.visual_delay_s);
        Self {
            arm: Arm::new(constants, resistance, at_m),
            constants: constants.clone(),
            mapping,
            random,
            unseen: std::iter::repeat_n(mapping.task_m(at_m), delay_ticks as usize).collect(),
            target_m: None,
            phase: Phase::Looking(delay_ticks),
            corrections: 0.0,
        }
    }

    /// The force on the handle in the next tick, N, and whether there is a click.
    pub(super) fn tick(&mut self, rig: &Rig, view: &View) -> (f64, bool) {
        self.unseen.push_back(self.mapping.task_m(rig.position_m()));
        let seen_m = self.unseen.pop_front().unwrap_or_default();
        if view.target_m != self.target_m {
            // A new target is seen as late as all else.
            self.target_m = view.target_m;
            self.corrections = self.constants.corrections;
            self.look();
        }
        let clicked = self
            .target_m
            .is_some_and(|target_m| self.decide(seen_m, target_m, view));
        (self.arm.force_n(rig, &mut self.random), clicked)
    }

    fn look(&mut self) {
        self.phase = Phase::Looking(ticks(self.constants.visual_delay_s));
    }

    /// Decides what to do; whether that is a click.
    fn decide(&mut self, seen_m: f64, target_m: f64, view: &View) -> bool {
        match self.phase {
            Phase::Looking(0) => {}
            Phase::Looking(ticks) => {
                self.phase = Phase::Looking(ticks - 1);
                return false;
            }
            Phase::Moving { .. } if !self.arm.is_over() => return false,
            Phase::Moving { sure } => {
                self.look();
                return sure;
            }
        }
        let distance_m = target_m - (seen_m + self.constants.visual_noise_m * self.random.normal());
        let margin_m = 0.5 * (view.width_m - view.cursor_diameter_m);
        if distance_m.abs() <= margin_m {
            self.look();
            return true;
        }
        let is_primary = distance_m.abs() > 0.5 * view.amplitude_m;
        if !is_primary && self.corrections < 1.0 {
            // It ought to be inside by now. What the click shows is corrected again.
            self.corrections = self.constants.corrections;
            self.look();
            return true;
        }
        if !is_primary {
            self.corrections -= 1.0;
        }
        self.move_by(distance_m, margin_m);
        false
    }

    /// Moves by a distance, m of the task, to within a margin, m.
    fn move_by(&mut self, distance_m: f64, margin_m: f64) {
        let Constants {
            endpoint_noise_s,
            shortest_movement_s,
            longest_movement_s,
            ..
        } = self.constants;
        // In this time one deviation of the end is the margin.
        let fair_s = endpoint_noise_s * distance_m.abs() / margin_m;
        let duration_s = fair_s.min(longest_movement_s).max(shortest_movement_s);
        let deviation = endpoint_noise_s / duration_s;
        let moved_m = distance_m * (1.0 + deviation * self.random.normal());
        let goal_m = self.arm.goal_m() + moved_m / self.mapping.gain;
        self.arm.move_to(goal_m, duration_s);
        self.phase = Phase::Moving {
            sure: deviation * distance_m.abs() <= 0.5 * margin_m,
        };
    }
}
