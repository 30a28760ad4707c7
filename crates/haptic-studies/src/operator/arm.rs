//! The arm of a simulated operator: a spring and a damper towards a place that moves by minimum jerk (Flash and
//! Hogan 1985), what was learned of the resistance, and the noise of the muscles.

use super::constants::Constants;
use super::rig::{Load, PERIOD_S, Rig};
use crate::random::Random;
use device_io::fake::RigProperties;

/// A movement from one place to another, at rest at both ends: `x = A (10 t^3 - 15 t^4 + 6 t^5)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Movement {
    from_m: f64,
    to_m: f64,
    duration_s: f64,
    gone_s: f64,
}

impl Movement {
    pub(super) fn rest(at_m: f64) -> Self {
        Self {
            from_m: at_m,
            to_m: at_m,
            duration_s: PERIOD_S,
            gone_s: PERIOD_S,
        }
    }

    fn to(self, to_m: f64, duration_s: f64) -> Self {
        Self {
            from_m: self.place().0,
            to_m,
            duration_s,
            gone_s: 0.0,
        }
    }

    fn is_over(&self) -> bool {
        self.gone_s >= self.duration_s
    }

    /// Position (m), velocity (m/s) and acceleration (m/s^2).
    fn place(&self) -> (f64, f64, f64) {
        let t = (self.gone_s / self.duration_s).min(1.0);
        let (length_m, rate) = (self.to_m - self.from_m, 1.0 / self.duration_s);
        (
            self.from_m + length_m * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
            length_m * rate * 30.0 * t * t * (1.0 - t) * (1.0 - t),
            length_m * rate * rate * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
        )
    }
}

/// The arm.
#[derive(Debug)]
pub(super) struct Arm {
    constants: Constants,
    /// What the operator has learned of the resistance.
    learned: Load,
    movement: Movement,
    /// Noise of the force, as a share of it; of unit deviation.
    noise: f64,
}

impl Arm {
    /// An arm at rest at a place, m, that has learned a resistance.
    pub(super) fn new(constants: &Constants, resistance: Load, at_m: f64) -> Self {
        let (bare, share) = (RigProperties::default(), constants.learned_share);
        Self {
            constants: constants.clone(),
            learned: Load {
                mass_kg: constants.arm_mass_kg + bare.mass_kg + share * resistance.mass_kg,
                static_n: share * (bare.friction_n + resistance.static_n),
                dynamic_n: share * (bare.friction_n + resistance.dynamic_n),
                viscous_ns_per_m: share * resistance.viscous_ns_per_m,
            },
            movement: Movement::rest(at_m),
            noise: 0.0,
        }
    }

    /// Where it pulls to at the end of its movement, m.
    pub(super) fn goal_m(&self) -> f64 {
        self.movement.to_m
    }

    /// Begins to move to a place, m, within a time, s.
    pub(super) fn move_to(&mut self, to_m: f64, duration_s: f64) {
        self.movement = self.movement.to(to_m, duration_s);
    }

    /// Whether its movement is over.
    pub(super) fn is_over(&self) -> bool {
        self.movement.is_over()
    }

    /// The force on the handle in the next tick, N.
    pub(super) fn force_n(&mut self, rig: &Rig, random: &mut Random) -> f64 {
        self.movement.gone_s += PERIOD_S;
        let (position_m, velocity_mps, acceleration_mps2) = self.movement.place();
        let Constants {
            arm_stiffness_n_per_m: stiffness,
            arm_damping_ns_per_m: damping,
            force_noise,
            force_noise_time_s,
            ..
        } = self.constants;
        let learned = &self.learned;
        let friction_n = if velocity_mps == 0.0 {
            0.0
        } else if rig.velocity_mps() == 0.0 {
            learned.static_n.copysign(velocity_mps)
        } else {
            learned.dynamic_n.copysign(velocity_mps)
        };
        let force_n = stiffness * (position_m - rig.position_m())
            + damping * (velocity_mps - rig.velocity_mps())
            + learned.mass_kg * acceleration_mps2
            + learned.viscous_ns_per_m * velocity_mps
            + friction_n;
        // A first-order filter of white noise, of unit deviation.
        let kept = 1.0 - PERIOD_S / force_noise_time_s;
        self.noise = kept * self.noise + (1.0 - kept * kept).max(0.0).sqrt() * random.normal();
        force_n * (1.0 + force_noise * self.noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_movement_of_minimum_jerk_is_at_rest_at_both_ends_and_fastest_in_its_middle() {
        let mut movement = Movement::rest(-0.1).to(0.1, 0.5);
        assert_eq!(movement.place(), (-0.1, 0.0, 0.0));
        movement.gone_s = 0.25;
        let (position, speed, acceleration) = movement.place();
        // 15/8 of the mean speed (Flash and Hogan 1985).
        assert!(position.abs() < 1e-15 && (speed - 0.4 * 15.0 / 8.0).abs() < 1e-12 && acceleration == 0.0);
        movement.gone_s = 0.7;
        let (position, speed, acceleration) = movement.place();
        assert!((position - 0.1).abs() < 1e-15 && speed == 0.0 && acceleration == 0.0);
    }
}
