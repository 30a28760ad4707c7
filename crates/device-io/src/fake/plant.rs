//! The carriage of the fake rig: mass, friction, cogging, a motor and a hand.
//!
//! Between two reads the motor's force is constant, as a real amplifier holds it, and the motion is
//! integrated by the implicit midpoint rule in steps of at most [`SUB_STEP_S`]: exact for a
//! constant force, stable for any arm, and friction is an inequality in each step, so that the
//! carriage truly rests when it rests. Elementary functions are those of `libm`, the same on every machine.

use super::hand::Hand;
use super::mechanics::sub_steps;
use std::f64::consts::TAU;

/// Longest step of the integration, s.
pub const SUB_STEP_S: f64 = 20e-6;

/// Properties of the fake rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigProperties {
    /// Mass of the moving part, kg.
    pub mass_kg: f64,
    /// Coulomb friction of the guide, N: of a motion in the positive direction, and in the negative
    /// one unless that has its own.
    pub friction_n: f64,
    /// Coulomb friction of a motion in the negative direction, N, where it differs.
    pub negative_friction_n: Option<f64>,
    /// Force that sets the carriage in motion, as a multiple of its Coulomb friction (>= 1). Without
    /// effect where it has a presliding stiffness.
    pub breakaway_ratio: f64,
    /// Stiffness of the guide before it slides, N/m (Dahl's law with an exponent of 1); `None` for a
    /// guide that is rigid.
    pub presliding_n_per_m: Option<f64>,
    /// Amplitude of the motor's cogging, N: the force of rest positions in the middle and every
    /// pitch from there.
    pub cogging_n: f64,
    /// Distance between two of these rest positions, m (> 0).
    pub cogging_pitch_m: f64,
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
            negative_friction_n: None,
            breakaway_ratio: 1.0,
            presliding_n_per_m: None,
            cogging_n: 0.0,
            cogging_pitch_m: 0.01,
            damping_ns_per_m: 0.0,
            resolution_m: 10e-6,
            end_stop_m: f64::INFINITY,
        }
    }
}

/// The carriage.
#[derive(Clone, Debug)]
pub struct Plant {
    properties: RigProperties,
    hand: Hand,
    position_m: f64,
    velocity_mps: f64,
    /// Deflection of a guide that gives way before it slides, m.
    deflection_m: f64,
}

impl Plant {
    /// A carriage at rest, at the place where its hand begins.
    #[must_use]
    pub fn new(properties: &RigProperties, hand: Hand) -> Self {
        let position_m = match &hand {
            Hand::Free | Hand::Push { .. } | Hand::Pointer(_) => 0.0,
            Hand::Prescribed(motion) | Hand::Arm { motion, .. } => motion.at(0.0).0,
        };
        Self {
            properties: *properties,
            hand,
            position_m,
            velocity_mps: 0.0,
            deflection_m: 0.0,
        }
    }

    /// Its properties.
    #[must_use]
    pub fn properties(&self) -> &RigProperties {
        &self.properties
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

    /// Gives it another hand, and returns that before.
    pub(super) fn take_in_hand(&mut self, hand: Hand) -> Hand {
        std::mem::replace(&mut self.hand, hand)
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
        if let Hand::Pointer(arm) = &mut self.hand {
            arm.live(elapsed_s, now_s, self.position_m);
        }
        for (h, middle_s) in sub_steps(elapsed_s, now_s, SUB_STEP_S) {
            self.step(h, middle_s, force_n);
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
            } => (offset_n + amplitude_n * libm::sin(TAU * frequency_hz * middle_s), 0.0),
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
            Hand::Pointer(arm) => arm.pull(middle_s, h, self.position_m),
        };
        let inertia = 2.0 * self.properties.mass_kg / h;
        let drive = inertia * self.velocity_mps + force_n + pull + self.cogging_n();
        let resistance = inertia + drag + self.properties.damping_ns_per_m;
        match self.properties.presliding_n_per_m {
            None => self.slide(h, drive, resistance),
            Some(stiffness) => self.deflect(h, drive, resistance, stiffness),
        }
        if self.position_m.abs() > self.properties.end_stop_m {
            self.position_m = self.properties.end_stop_m.copysign(self.position_m);
            self.velocity_mps = 0.0;
        }
    }

    /// The force that draws the carriage to the nearest rest position of the motor, N.
    fn cogging_n(&self) -> f64 {
        if self.properties.cogging_n == 0.0 {
            return 0.0;
        }
        -self.properties.cogging_n * libm::sin(TAU * self.position_m / self.properties.cogging_pitch_m)
    }

    /// Coulomb friction of a motion the way of `direction`, N.
    fn friction_n(&self, direction: f64) -> f64 {
        match self.properties.negative_friction_n {
            Some(negative_n) if direction < 0.0 => negative_n,
            _ => self.properties.friction_n,
        }
    }

    /// A step on a rigid guide.
    fn slide(&mut self, h: f64, drive: f64, resistance: f64) {
        let friction_n = self.friction_n(drive);
        let holds_n = if self.velocity_mps == 0.0 {
            self.properties.breakaway_ratio * friction_n
        } else {
            friction_n
        };
        if drive.abs() <= holds_n {
            self.velocity_mps = 0.0;
            return;
        }
        let middle = (drive - friction_n.copysign(drive)) / resistance;
        let end = 2.0 * middle - self.velocity_mps;
        self.position_m += h * middle;
        // Friction stops a motion, it does not turn it round: the next step decides whether it
        // starts again.
        self.velocity_mps = if end * middle < 0.0 { 0.0 } else { end };
    }

    /// A step on a guide that gives way: Dahl's law, whose deflection is exact for an even motion.
    fn deflect(&mut self, h: f64, drive: f64, resistance: f64, stiffness: f64) {
        let middle = (drive - stiffness * self.deflection_m) / resistance;
        self.velocity_mps = 2.0 * middle - self.velocity_mps;
        self.position_m += h * middle;
        // With the speed at the end, so that the spring makes no energy.
        let distance_m = h * self.velocity_mps;
        let steady_m = (self.friction_n(distance_m) / stiffness).copysign(distance_m);
        if steady_m != 0.0 {
            self.deflection_m = steady_m + (self.deflection_m - steady_m) * libm::exp(-distance_m / steady_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::HandMotion;

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

    /// The carriage after a time under a steady force.
    fn pushed(properties: RigProperties, force_n: f64, seconds: f64) -> Plant {
        let mut plant = Plant::new(&properties, Hand::Free);
        plant.advance(seconds, seconds, force_n);
        plant
    }

    #[test]
    fn friction_depends_on_direction_and_breaks_away_higher() {
        let properties = RigProperties {
            mass_kg: 1.0,
            friction_n: 0.5,
            negative_friction_n: Some(1.5),
            breakaway_ratio: 1.2,
            ..RigProperties::default()
        };
        for (force_n, speed_mps) in [(0.59, 0.0), (0.61, 0.11), (-1.79, 0.0), (-1.81, -0.31)] {
            let speed = pushed(properties, force_n, 1.0).velocity_mps();
            assert!((speed - speed_mps).abs() < 1e-9, "{force_n} N: {speed} m/s");
        }
    }

    #[test]
    fn cogging_holds_at_rest_positions_and_takes_no_energy() {
        let properties = RigProperties {
            mass_kg: 1.0,
            friction_n: 0.0,
            cogging_n: 0.3,
            cogging_pitch_m: 0.01,
            ..RigProperties::default()
        };
        let mut plant = Plant::new(&properties, Hand::Free);
        // 0.3 N a rad of 2 pi in 10 mm: a push of half the amplitude is held at a twelfth of the pitch,
        // and swings to twice that.
        let mut farthest: f64 = 0.0;
        for tick in 1..=2000 {
            plant.advance(1e-3, f64::from(tick) * 1e-3, 0.15);
            farthest = farthest.max(plant.position_m());
        }
        assert!(farthest > 1.6e-3 && farthest < 2.1e-3, "{farthest} m");
        let mut fast = Plant::new(&properties, Hand::Free);
        fast.velocity_mps = 0.1;
        while fast.position_m() < 0.01 {
            fast.advance(1e-4, 1.0, 0.0);
        }
        assert!((fast.velocity_mps() - 0.1).abs() < 1e-4, "{fast:?}");
    }

    #[test]
    fn guide_deflects_elastically_then_slides_at_friction() {
        let properties = RigProperties {
            mass_kg: 1.0,
            friction_n: 0.8,
            negative_friction_n: Some(0.4),
            presliding_n_per_m: Some(2e4),
            damping_ns_per_m: 20.0,
            ..RigProperties::default()
        };
        // Dahl: F = Fc (1 - exp(-sigma x / Fc)), so 0.4 of 0.8 N at ln 2 of 40 um.
        // A sudden force would swing beyond that.
        let mut plant = Plant::new(&properties, Hand::Free);
        for tick in 1..=4000 {
            let now_s = f64::from(tick) * 1e-3;
            plant.advance(1e-3, now_s, 0.1 * now_s);
        }
        let held_m = plant.position_m();
        let expected_m = 4e-5 * std::f64::consts::LN_2;
        assert!((held_m - expected_m).abs() < 0.2e-5, "{plant:?}");
        for (force_n, speed_mps) in [(1.8, 0.05), (-1.4, -0.05)] {
            let speed = pushed(properties, force_n, 1.0).velocity_mps();
            assert!((speed - speed_mps).abs() < 1e-6, "{force_n} N: {speed} m/s");
        }
        // Let go, it springs back and rests.
        plant.advance(1.0, 5.0, 0.0);
        assert!(plant.velocity_mps().abs() < 1e-6, "{plant:?}");
        assert!(plant.position_m() < 0.7 * held_m, "{plant:?}");
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
        let motion = HandMotion::Sine {
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
