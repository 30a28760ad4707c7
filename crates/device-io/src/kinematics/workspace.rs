//! Where force may flow, and what the motors and encoders give there.

use super::{Kinematics, KinematicsError};
use haptic_core::planar::Plane;

/// Distance of the points at which a workspace is looked at, m.
const GRID_M: f64 = 2e-3;

/// The smallest singular value is at least so large a part of the largest, and of the proximal link: beyond that a
/// little error of angle is a large one of place, and little force takes all that the motors have.
const MIN_SHARE: f64 = 0.25;

/// A rectangle of the plane, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// From and to, along the first axis.
    pub x_m: [f64; 2],
    /// From and to, along the second axis.
    pub y_m: [f64; 2],
}

/// What holds everywhere in a workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Largest distance, m, that the handle moves with a unit of one motor's motion.
    pub most_m: f64,
}

impl Reach {
    /// The force, N, that motors of so much effort (N m or N) give in every direction and place.
    #[must_use]
    pub fn force_n(&self, effort: f64) -> f64 {
        effort / self.most_m
    }

    /// The distance, m, of two positions that can be told apart everywhere, with so many counts a rad or m.
    #[must_use]
    pub fn resolution_m(&self, counts: f64) -> f64 {
        self.most_m / counts
    }
}

impl Workspace {
    /// Whether a position is inside.
    #[must_use]
    pub fn contains(&self, position: Plane) -> bool {
        let within = |at: f64, [from, to]: [f64; 2]| from <= at && at <= to;
        within(position.x, self.x_m) && within(position.y, self.y_m)
    }

    /// Looks at every place of it.
    ///
    /// # Errors
    /// A place is out of reach or too near a singularity; the worst one is named.
    pub fn check(&self, kinematics: &Kinematics) -> Result<Reach, KinematicsError> {
        let mut reach = Reach { most_m: 0.0 };
        let mut worst: Option<(f64, Plane)> = None;
        for y_m in steps(self.y_m) {
            for x_m in steps(self.x_m) {
                let position = Plane::new(x_m, y_m);
                let pose = kinematics.motors(position).and_then(|motors| kinematics.pose(motors));
                // The other assembly of the linkage is another place.
                let pose = pose.filter(|pose| (pose.position - position).length() < 1e-9);
                let Some(pose) = pose else {
                    return Err(KinematicsError::OutOfReach { x_m, y_m });
                };
                let [least, most] = pose.jacobian.singular_values();
                let proximal_m = match kinematics {
                    Kinematics::FiveBar(linkage) => linkage.proximal_m,
                    _ => 0.0,
                };
                let share = least / most.max(proximal_m);
                if worst.is_none_or(|(of_worst, _)| share < of_worst) {
                    worst = Some((share, position));
                }
                reach.most_m = reach.most_m.max(pose.jacobian.first.length()).max(pose.jacobian.second.length());
            }
        }
        match worst {
            Some((share, at)) if share < MIN_SHARE => Err(KinematicsError::Singular {
                x_m: at.x,
                y_m: at.y,
                share,
            }),
            _ => Ok(reach),
        }
    }
}

/// Points from one end to the other, both ends included.
fn steps([from, to]: [f64; 2]) -> impl Iterator<Item = f64> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a workspace of a thousand steps at most, as its file is checked"
    )]
    let count = ((to - from) / GRID_M).ceil().max(1.0) as u32;
    (0..=count).map(move |step| from + (to - from) * f64::from(step) / f64::from(count))
}
