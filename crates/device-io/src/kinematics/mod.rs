//! Two motors that move one handle in the plane: from what they measure to where it is, and from a force to what they
//! pull.
//!
//! The [`Jacobian`] is the exact derivative of the position, from the same function. So the power of the motors is that
//! of the force at the handle, whatever the geometry: wrong lengths distort the surface, but cannot drive the hand.
//! Force is mapped by the transpose, `tau = J' F`, and velocity by `p' = J q'`.

mod file;
mod five_bar;
mod workspace;

pub use file::KinematicsError;
pub use five_bar::FiveBar;
pub use workspace::{Reach, Workspace};

use haptic_core::planar::Plane;

/// How two motors move one handle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinematics {
    /// A gantry: each motor measures one axis, m.
    Xy,
    /// Both motors drive one belt (CoreXY, H-Man): `x` is half the sum of what they measure, m, and `y` half the
    /// difference.
    HBelt,
    /// Two arms of two links each, whose ends meet at the handle; the motors measure rad.
    FiveBar(FiveBar),
}

/// Where the handle is, and how it moves with the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// m.
    pub position: Plane,
    /// By motor.
    pub jacobian: Jacobian,
}

/// How the handle moves with each motor: m a rad, or m a m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian {
    /// With the first motor.
    pub first: Plane,
    /// With the second motor.
    pub second: Plane,
}

impl Jacobian {
    /// Velocity of the handle, m/s, from those of the motors.
    #[must_use]
    pub fn velocity(&self, [first, second]: [f64; 2]) -> Plane {
        self.first * first + self.second * second
    }

    /// What the motors pull, N m or N, for a force on the handle, N.
    #[must_use]
    pub fn efforts(&self, force: Plane) -> [f64; 2] {
        [self.first.dot(force), self.second.dot(force)]
    }

    /// The smallest and the largest distance that a unit of the motors' motion moves the handle.
    #[must_use]
    pub fn singular_values(&self) -> [f64; 2] {
        let Self { first, second } = self;
        // Of a matrix of two rows and columns, as half the sum and difference of two lengths.
        let alike = Plane::new(first.x + second.y, first.y - second.x).length();
        let unlike = Plane::new(first.x - second.y, first.y + second.x).length();
        [0.5 * (alike - unlike).abs(), 0.5 * (alike + unlike)]
    }
}

impl Kinematics {
    /// Whether the motors measure angles.
    #[must_use]
    pub fn is_rotary(&self) -> bool {
        matches!(self, Self::FiveBar(_))
    }

    /// The pose for what the motors measure; `None` where a linkage cannot close there.
    #[must_use]
    pub fn pose(&self, motors: [f64; 2]) -> Option<Pose> {
        let [a, b] = motors;
        match self {
            Self::Xy => Some(Pose {
                position: Plane::new(a, b),
                jacobian: Jacobian {
                    first: Plane::new(1.0, 0.0),
                    second: Plane::new(0.0, 1.0),
                },
            }),
            Self::HBelt => Some(Pose {
                position: Plane::new(0.5 * (a + b), 0.5 * (a - b)),
                jacobian: Jacobian {
                    first: Plane::new(0.5, 0.5),
                    second: Plane::new(0.5, -0.5),
                },
            }),
            Self::FiveBar(linkage) => linkage.pose(motors),
        }
    }

    /// What the motors measure where the handle is at a position, m; `None` out of reach.
    #[must_use]
    pub fn motors(&self, position: Plane) -> Option<[f64; 2]> {
        match self {
            Self::Xy => Some([position.x, position.y]),
            Self::HBelt => Some([position.x + position.y, position.x - position.y]),
            Self::FiveBar(linkage) => linkage.motors(position),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Of Haply's first generation.
    pub(super) fn haply(base_m: f64) -> FiveBar {
        FiveBar {
            base_m,
            proximal_m: 0.07,
            distal_m: 0.09,
        }
    }

    fn any() -> impl Strategy<Value = (Kinematics, [f64; 2])> {
        let five_bar = (0.0..0.06, 1.8..3.3f64, -0.2..1.3f64)
            .prop_map(|(base_m, left, right)| (Kinematics::FiveBar(haply(base_m)), [left, right]));
        let linear = prop::array::uniform2(-0.1..0.1f64);
        prop_oneof![
            linear.clone().prop_map(|motors| (Kinematics::Xy, motors)),
            linear.prop_map(|motors| (Kinematics::HBelt, motors)),
            five_bar
        ]
    }

    proptest! {
        #[test]
        fn jacobian_is_the_derivative_of_the_position((kinematics, [a, b]) in any()) {
            let step = 1e-5;
            let at = |a, b| kinematics.pose([a, b]).map(|pose| pose.position);
            let Some(pose) = kinematics.pose([a, b]) else { return Ok(()) };
            let ends = [at(a - step, b), at(a + step, b), at(a, b - step), at(a, b + step)];
            let [Some(a0), Some(a1), Some(b0), Some(b1)] = ends else { return Ok(()) };
            prop_assume!(pose.jacobian.singular_values()[1] < 0.5);
            let first = (a1 - a0) * (0.5 / step) - pose.jacobian.first;
            let second = (b1 - b0) * (0.5 / step) - pose.jacobian.second;
            prop_assert!(first.length() < 1e-6 && second.length() < 1e-6, "{first:?} {second:?}");
        }

        #[test]
        fn power_of_the_motors_is_that_of_the_force(
            (kinematics, motors) in any(), rates in prop::array::uniform2(-5.0..5.0f64), x in -20.0..20.0f64, y in -20.0..20.0f64,
        ) {
            let Some(Pose { jacobian, .. }) = kinematics.pose(motors) else { return Ok(()) };
            let force = Plane::new(x, y);
            let efforts = jacobian.efforts(force);
            let of_motors = efforts[0] * rates[0] + efforts[1] * rates[1];
            let of_force = force.dot(jacobian.velocity(rates));
            let size = 1.0 + efforts[0].abs() * rates[0].abs() + efforts[1].abs() * rates[1].abs();
            prop_assert!((of_motors - of_force).abs() <= 1e-12 * size, "{of_motors} W for {of_force} W");
        }

        #[test]
        fn motors_and_position_are_each_others_inverse((kinematics, motors) in any()) {
            let Some(pose) = kinematics.pose(motors) else { return Ok(()) };
            prop_assume!(pose.jacobian.singular_values()[1] < 0.5);
            // An elbow that has passed its dead centre is another way to the same place.
            let Some(back) = kinematics.motors(pose.position) else { return Ok(()) };
            let again = kinematics.pose(back).expect("a pose");
            prop_assert!((again.position - pose.position).length() < 1e-9, "{:?} for {:?}", again.position, pose.position);
        }
    }
}
