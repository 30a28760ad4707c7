//! The carriage of the fake rig: mass, Coulomb and viscous friction, a motor and a hand.
//!
//! Between two reads the motor's force is constant, as a real amplifier holds it, and the motion is
//! integrated by the implicit midpoint rule in steps of at most [`SUB_STEP_S`]: exact for a
//! constant force, stable for any arm, and friction is an inequality in each step, so that the
//! carriage truly rests when it rests.

use super::hand::Hand;
use std::f64::consts::TAU;

/// Longest step of the integration, s.
pub const SUB_STEP_S: f64 = 20e-6;

/// Most steps between two reads: after a stall the steps grow instead of their number.
const MAX_SUB_STEPS: f64 = 1000.0;

/// Properties of the fake rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigProperties {
    /// Mass of the moving part, kg.
    pub mass_kg: f64,
    /// Coulomb friction of the guide, N.
    pub friction_n: f64,
    /// Viscous damping of the guide, N s/m.
    pub damping_ns_per_m: f64,
    /// Distance between two counts of the encoder, m; 0 for a perfect one.
    pub resolution_m: f64,
    /// Distance from the middle to the stop at either end, m; infinite without stops. A prescribed
    /// hand is not held.
    pub end_stop_m: f64,
}

impl Default for RigProperties {
    /// The desk-top rig of the reference measurements.
    fn default() -> Self {
        Self {
            mass_kg: 1.4,
            friction_n: 0.8,
            damping_ns_per_m: 0.0,
            resolution_m: 10e-6,
            end_stop_m: f64::INFINITY,
        }
    }
}

/// The carriage.
#[derive(Clone, Debug)]
pub struct Plant {
    mass_kg: f64,
    friction_n: f64,
    damping_ns_per_m: f64,
    end_stop_m: f64,
    hand: Hand,
    position_m: f64,
    velocity_mps: f64,
}

impl Plant {
    /// A carriage at rest, at the place where its hand begins.
    #[must_use]
    pub fn new(properties: &RigProperties, hand: Hand) -> Self {
        let position_m = match &hand {
            Hand::Free | Hand::Push { .. } => 0.0,
            Hand::Prescribed(motion) | Hand::Arm { motion, .. } => motion.at(0.0).0,
        };
        Self {
            mass_kg: properties.mass_kg,
            friction_n: properties.friction_n,
            damping_ns_per_m: properties.damping_ns_per_m,
            end_stop_m: properties.end_stop_m,
            hand,
            position_m,
            velocity_mps: 0.0,
        }
    }

    /// Position, m.
    #[must_use]
    pub fn position_m(&self) -> f64 {
        self.position_m
    }

    /// Velocity, m/s.
    #[must_use]
    pub fn velocity_mps(&self) -> f64 {
        self.velocity_mps
    }

    /// The hand.
    #[must_use]
    pub fn hand(&self) -> &Hand {
        &self.hand
    }

    /// Lives through the `elapsed_s` seconds that end at `now_s`, with the motor at `force_n`.
    pub fn advance(&mut self, elapsed_s: f64, now_s: f64, force_n: f64) {
        if let Hand::Prescribed(motion) = &self.hand {
            (self.position_m, self.velocity_mps) = motion.at(now_s);
            return;
        }
        if elapsed_s <= 0.0 {
            return;
        }
        let steps = (elapsed_s / SUB_STEP_S).ceil().min(MAX_SUB_STEPS);
        let h = elapsed_s / steps;
        let mut middle_s = now_s - elapsed_s + 0.5 * h;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 1000")]
        for _ in 0..steps as u32 {
            self.step(h, middle_s, force_n);
            middle_s += h;
        }
    }

    /// One implicit midpoint step of `h` seconds around `middle_s`.
    fn step(&mut self, h: f64, middle_s: f64, force_n: f64) {
        let (pull, drag) = match &self.hand {
            Hand::Free | Hand::Prescribed(_) => (0.0, 0.0),
            Hand::Push {
                offset_n,
                amplitude_n,
                frequency_hz,
            } => (offset_n + amplitude_n * (TAU * frequency_hz * middle_s).sin(), 0.0),
            Hand::Arm {
                stiffness_n_per_m,
                damping_ns_per_m,
                motion,
            } => {
                let (wanted, speed) = motion.at(middle_s);
                (
                    stiffness_n_per_m * (wanted - self.position_m) + damping_ns_per_m * speed,
                    0.5 * stiffness_n_per_m * h + damping_ns_per_m,
                )
            }
        };
        let inertia = 2.0 * self.mass_kg / h;
        let drive = inertia * self.velocity_mps + force_n + pull;
        if drive.abs() <= self.friction_n {
            self.velocity_mps = 0.0;
            return;
        }
        let middle = (drive - self.friction_n.copysign(drive)) / (inertia + drag + self.damping_ns_per_m);
        let end = 2.0 * middle - self.velocity_mps;
        self.position_m += h * middle;
        // Friction stops a motion, it does not turn it round: the next step decides whether it
        // starts again.
        self.velocity_mps = if end * middle < 0.0 { 0.0 } else { end };
        if self.position_m.abs() > self.end_stop_m {
            self.position_m = self.end_stop_m.copysign(self.position_m);
            self.velocity_mps = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::Motion;

    #[test]
    fn a_constant_force_gives_a_parabola() {
        let mut plant = Plant::new(&RigProperties::default(), Hand::Free);
        for k in 1..=1000 {
            plant.advance(1e-3, f64::from(k) * 1e-3, 2.2);
        }
        // (2.2 - 0.8) N on 1.4 kg: 1 m/s^2.
        assert!((plant.velocity_mps() - 1.0).abs() < 1e-9, "{plant:?}");
        assert!((plant.position_m() - 0.5).abs() < 1e-9, "{plant:?}");
    }

    #[test]
    fn friction_holds_stops_and_does_not_push() {
        let mut plant = Plant::new(&RigProperties::default(), Hand::Free);
        plant.advance(1.0, 1.0, 0.79);
        assert_eq!(plant.velocity_mps(), 0.0);
        plant.advance(0.1, 1.1, 2.2);
        plant.advance(1.0, 2.1, 0.0);
        assert_eq!(plant.velocity_mps(), 0.0);
        // v^2 / 2a with v = 0.1 m/s, a = 0.8/1.4, after 5 mm of pull; the stop falls within one
        // step.
        let expected = 0.005 + 0.01 * 1.4 / 1.6;
        assert!((plant.position_m() - expected).abs() < 2e-6, "{plant:?}");
    }

    #[test]
    fn a_stop_at_the_end_stops_without_bouncing() {
        let properties = RigProperties {
            end_stop_m: 0.01,
            ..RigProperties::default()
        };
        let mut plant = Plant::new(&properties, Hand::Free);
        plant.advance(1.0, 1.0, 5.0);
        assert_eq!((plant.position_m(), plant.velocity_mps()), (0.01, 0.0));
        plant.advance(2.0, 3.0, -5.0);
        assert_eq!((plant.position_m(), plant.velocity_mps()), (-0.01, 0.0));
    }

    #[test]
    fn a_stiff_arm_follows_its_hand_whatever_the_step() {
        let motion = Motion::Sine {
            amplitude_m: 0.03,
            frequency_hz: 1.0,
        };
        let hand = Hand::Arm {
            stiffness_n_per_m: 1e6,
            damping_ns_per_m: 1e3,
            motion: motion.clone(),
        };
        let mut plant = Plant::new(&RigProperties::default(), hand);
        let mut now = 0.0;
        for k in 0..500 {
            let elapsed = if k == 250 { 0.5 } else { 1e-3 };
            now += elapsed;
            plant.advance(elapsed, now, 0.0);
            assert!((plant.position_m() - motion.at(now).0).abs() < 1e-3, "{k}: {plant:?}");
        }
    }
}
