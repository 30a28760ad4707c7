//! A rig of two motors and the hand on it: a mass in the plane that an arm drags along a path. The motors' efforts
//! become a force on the hand, and its position the motors' positions, through the rig's kinematics.

use super::hand::{ARM_DAMPING_NS_PER_M, ARM_STIFFNESS_N_PER_M};
use super::mechanics::{RigTime, sub_steps};
use super::path::Path;
use crate::kinematics::{Kinematics, Reading};
use haptic_core::planar::Plane;

/// Longest step of the integration, s. The implicit midpoint rule is stable for any arm.
const SUB_STEP_S: f64 = 100e-6;

/// Time in which the hand comes from its rest to its path, or back, s.
const JOIN_S: f64 = 1.0;

/// Properties of the hand and the moving mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarProperties {
    /// Mass that moves with the hand, kg.
    pub mass_kg: f64,
    /// Coulomb friction, N, in every direction.
    pub friction_n: f64,
    /// Viscous damping, N s/m.
    pub damping_ns_per_m: f64,
    /// Distance between two counts of each motor's encoder, m or rad; at least 1e-9.
    pub count: f64,
}

impl PlanarProperties {
    /// A light hand-held linkage, or a gantry.
    #[must_use]
    pub fn of(kinematics: &Kinematics) -> Self {
        Self {
            mass_kg: 0.3,
            friction_n: 0.1,
            damping_ns_per_m: 0.0,
            count: if kinematics.are_rotary() {
                std::f64::consts::TAU / 16_384.0
            } else {
                10e-6
            },
        }
    }
}

/// The rig. It has no clock: it lives through the times that its caller gives.
#[derive(Clone, Debug)]
pub struct PlanarRig {
    properties: PlanarProperties,
    kinematics: Kinematics,
    /// `None` without a hand.
    path: Option<Path>,
    /// Where it was switched on, and where the hand rests, m.
    origin: Plane,
    position: Plane,
    velocity: Plane,
    motors: [f64; 2],
    efforts: [f64; 2],
    /// Share of the distance from rest to the path, in time, and whether the hand goes back to rest.
    joined: f64,
    rests: bool,
    /// Whether the hand is off the handle.
    is_off: bool,
    time: RigTime,
}

impl PlanarRig {
    /// A rig at rest in its home pose, or at the beginning of the path where it has none. The hand joins its path in a
    /// second.
    ///
    /// # Errors
    /// The path begins where the links do not reach.
    pub fn new(properties: PlanarProperties, kinematics: Kinematics, path: Option<Path>) -> Result<Self, String> {
        let (motors, origin) = match kinematics.home().map(|home| (home, kinematics.reading(home))) {
            Some((home, Reading::Position(pose) | Reading::Singular(pose))) => (home, pose.position),
            // A home pose that does not close is no kinematics.
            Some((_, Reading::CannotClose)) | None => {
                let origin = path.as_ref().map_or_else(|| kinematics.middle(), |path| path.at(0.0).0);
                let motors = kinematics.motors(origin);
                let beyond = || format!("the links do not reach x = {} m, y = {} m", origin.x, origin.y);
                (motors.ok_or_else(beyond)?, origin)
            }
        };
        Ok(Self {
            properties: PlanarProperties {
                count: properties.count.max(1e-9),
                ..properties
            },
            kinematics,
            path,
            origin,
            position: origin,
            velocity: Plane::ZERO,
            motors,
            efforts: [0.0; 2],
            joined: 0.0,
            rests: false,
            is_off: false,
            time: RigTime::default(),
        })
    }

    /// Its kinematics.
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// The path of its hand, where there is one.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.path.as_ref()
    }

    /// Its properties.
    #[must_use]
    pub fn properties(&self) -> &PlanarProperties {
        &self.properties
    }

    /// Position of the hand, m.
    #[must_use]
    pub fn position(&self) -> Plane {
        self.position
    }

    /// Puts the hand to a position, m, at rest.
    #[cfg(test)]
    pub(super) fn put(&mut self, position: Plane) {
        self.motors = self.kinematics.motors(position).expect("within reach");
        (self.position, self.velocity) = (position, Plane::ZERO);
    }

    /// The encoders, counts. Relative ones began in the home pose.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a desk-top rig goes far less than 2^31 counts"
    )]
    pub fn counts(&self) -> [i32; 2] {
        let home = self.kinematics.home().unwrap_or_default();
        [0, 1].map(|motor| ((self.motors[motor] - home[motor]) / self.properties.count).round() as i32)
    }

    /// Sets the efforts of the motors, N or N m, until the next call.
    pub fn drive(&mut self, efforts: [f64; 2]) {
        self.efforts = efforts;
    }

    /// The force of the motors on the hand, N; none where the linkage is singular.
    #[must_use]
    pub fn force(&self) -> Plane {
        match self.kinematics.reading(self.motors) {
            Reading::Position(pose) => pose.jacobian.force(self.efforts),
            Reading::Singular(_) | Reading::CannotClose => Plane::ZERO,
        }
    }

    /// Sends the hand to where the rig was switched on, or lets it draw.
    pub fn rest(&mut self, rests: bool) {
        self.rests = rests;
    }

    /// Takes the hand off the handle, or lays it on again.
    pub fn let_go(&mut self, is_off: bool) {
        self.is_off = is_off;
    }

    /// Lives until `now_ns`, ns. It begins at the first time.
    pub fn live_until(&mut self, now_ns: u64) {
        let (elapsed_s, now_s) = self.time.go_on(now_ns);
        if elapsed_s <= 0.0 {
            return;
        }
        for (h, middle_s) in sub_steps(elapsed_s, now_s, SUB_STEP_S) {
            self.step(h, middle_s);
        }
    }

    /// The time since it began, ns.
    pub(super) fn time_ns(&self) -> u64 {
        self.time.ns()
    }

    /// Where the arm draws the hand at a time, m, and with which velocity, m/s.
    fn aim(&mut self, h: f64, middle_s: f64) -> Option<(Plane, Plane)> {
        let (position, velocity) = self.path.as_ref()?.at(middle_s);
        let step = if self.rests { -h } else { h } / JOIN_S;
        let before = self.joined;
        self.joined = (before + step).clamp(0.0, 1.0);
        let rate = (self.joined - before) / h;
        let (share, slope) = smooth(0.5 * (before + self.joined));
        let away = position - self.origin;
        Some((self.origin + away * share, velocity * share + away * (slope * rate)))
    }

    /// One implicit midpoint step of `h` seconds around `middle_s`, as the carriage on a line makes it.
    fn step(&mut self, h: f64, middle_s: f64) {
        let PlanarProperties {
            mass_kg,
            friction_n,
            damping_ns_per_m,
            ..
        } = self.properties;
        let (stiffness, damping) = (ARM_STIFFNESS_N_PER_M, ARM_DAMPING_NS_PER_M);
        let (pull, drag) = match self.aim(h, middle_s).filter(|_| !self.is_off) {
            Some((position, velocity)) => (
                (position - self.position) * stiffness + velocity * damping,
                0.5 * stiffness * h + damping,
            ),
            None => (Plane::ZERO, 0.0),
        };
        let inertia = 2.0 * mass_kg / h;
        let drive = self.velocity * inertia + self.force() + pull;
        let strength = drive.length();
        if strength <= friction_n {
            self.velocity = Plane::ZERO;
            return;
        }
        let middle = drive * ((1.0 - friction_n / strength) / (inertia + drag + damping_ns_per_m));
        let end = middle * 2.0 - self.velocity;
        let position = self.position + middle * h;
        let Some(motors) = self.kinematics.motors(position) else {
            // The links hold the hand where they end.
            self.velocity = Plane::ZERO;
            return;
        };
        self.position = position;
        let are_rotary = self.kinematics.are_rotary();
        self.motors = [0, 1].map(|motor| {
            if are_rotary {
                nearest_turn(motors[motor], self.motors[motor])
            } else {
                motors[motor]
            }
        });
        // Friction stops a motion, it does not turn it round: the next step decides whether it starts again.
        self.velocity = if end.dot(middle) < 0.0 { Plane::ZERO } else { end };
    }
}

/// The same angle, rad, in the turn that is nearest to another: an encoder counts on where an angle begins anew.
fn nearest_turn(angle: f64, other: f64) -> f64 {
    use std::f64::consts::TAU;
    angle + TAU * ((other - angle) / TAU).round()
}

/// A smooth rise from 0 to 1, level at both ends, and its slope.
fn smooth(share: f64) -> (f64, f64) {
    (share * share * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share))
}
